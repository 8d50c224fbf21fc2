// Trajectories in the TUM text format, and pairing two of them by time.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "protocol/types/pose.h"
#include "protocol/types/result.h"

namespace comap {

struct StampedPose {
  int64_t stamp_ns = 0;
  Pose pose;  ///< of the camera, in whatever frame the file is in
};

/// Lines `timestamp tx ty tz qx qy qz qw`, seconds and metres, # starts a comment. Strict: eight finite numbers a line,
/// stamps that grow, quaternions of unit length to 2 %. kUnreachable or kBadData (with file and line) otherwise.
Result<std::vector<StampedPose>> readTrajectory(const std::string& path);

struct PosePair {
  StampedPose estimate, truth;
};

inline constexpr int64_t kMaxAssociationGap_ns = 20'000'000;

/// Pairs one estimate with one truth, the closest in time first, none farther apart than 0.02 s; sorted by time of the
/// estimate. Both inputs in order of time.
std::vector<PosePair> associate(const std::vector<StampedPose>& estimate, const std::vector<StampedPose>& truth);

}  // namespace comap
