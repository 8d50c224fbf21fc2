// The text files of a TUM-format folder: which colour belongs to which depth, and the camera.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "protocol/types/camera.h"
#include "protocol/types/result.h"

namespace comap {

/// Colour and depth pictures farther apart than this are not a pair.
inline constexpr int64_t kMaxPairGap_ns = 20'000'000;

struct TumPair {
  int64_t stamp_ns = 0;  ///< of the colour picture, to which poses belong
  std::string colour_path, depth_path;
};

struct TumCalibration {
  CameraModel camera;           ///< fy < 0 as found: y of the camera frame points up
  double depth_scale = 5000.0;  ///< stored depth values to the metre
};

/// One line that is not a comment: `fx fy cx cy width height depth_scale`. kBadData names the value that is wrong.
Result<TumCalibration> readTumCalibration(const std::string& path);

/// All pairs of the folder in order of time: from associations.txt, else from rgb.txt and depth.txt by nearest time,
/// each picture used once. Paths start with `directory`; a listed path may not lead out of it. Pictures are not opened.
Result<std::vector<TumPair>> readTumPairs(const std::string& directory);

}  // namespace comap
