// One frame of reference with the surfel map, the places and the history in it, and the cameras that move in it.
#pragma once

#include <string>
#include <vector>

#include "mapping_core/paper/fern_memory.h"
#include "mapping_core/surfels/timed_surfel_map.h"

namespace comap {

struct LoggedPose {
  uint32_t tick = 0;
  int64_t stamp_ns = 0;
  Pose T_map_cam;
};

/// Two points that an earlier loop has brought together.
struct Tie {
  Eigen::Vector3d source = Eigen::Vector3d::Zero(), target = Eigen::Vector3d::Zero();  ///< map frame, metres
  FrameTime source_time, target_time;
};

struct ReferenceFrame {
  std::string name;  ///< of the camera that began it
  TimedSurfelMap map;
  FernMemory ferns;
  std::vector<Tie> ties{};
  uint32_t deformed_at = 0;  ///< tick of the last local deformation; 0 = none yet
  uint32_t merged_at = 0;    ///< tick at which it last took in another map; 0 = never
};

struct PaperCamera {
  uint32_t index = 0;
  std::string name;
  CameraModel model;
  Pose T_map_cam;
  std::vector<LoggedPose> log{};
  size_t frame = 0;          ///< which reference frame it moves in
  uint32_t deformed_at = 0;  ///< tick of its last local deformation, where each camera has nodes of its own; 0 = none
  // What the next frame is tracked against.
  Pyramid live{};       ///< of the last frame
  Pyramid reference{};  ///< predicted from the last pose
  FilledView filled{};  ///< the same, with its holes filled
};

}  // namespace comap
