// An odometry under measurement: ours, or another one on the same frames.
#pragma once

#include <string>

#include "protocol/types/image.h"
#include "protocol/types/messages.h"

namespace comap {

struct Step {
  Pose T_odom_cam;
  TrackingState state = TrackingState::kOk;
  bool keyframe = false;
  double cpu_ms = 0, wall_ms = 0;  ///< of the odometry alone, without converting the frame into its own format
  std::string note;                ///< numbers of this frame, for people; may be empty
};

class Method {
 public:
  virtual ~Method() = default;
  virtual std::string name() const = 0;
  /// The next frame of one sequence; all in order, on one thread.
  virtual Step step(const Frame& frame) = 0;
};

}  // namespace comap
