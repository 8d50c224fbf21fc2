// The true poses of a recording, by stamp.
#pragma once

#include <string>

#include "fleet_tools/evaluate/metrics_trajectory.h"

namespace comap {

class Truth {
 public:
  /// Of `DIR[@FIRST:LAST]`: DIR/groundtruth.txt.
  static Result<Truth> of(const std::string& source);
  /// The pose within 20 ms of the stamp.
  Result<Pose> at(int64_t stamp_ns) const;

 private:
  std::string name_;
  std::vector<StampedPose> poses_;
};

}  // namespace comap
