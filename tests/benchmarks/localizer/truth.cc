#include "tests/benchmarks/localizer/truth.h"

#include <algorithm>
#include <cstdlib>

namespace comap {

Result<Truth> Truth::of(const std::string& source) {
  Truth truth;
  truth.name_ = source.substr(0, source.find('@')) + "/groundtruth.txt";
  auto poses = readTrajectory(truth.name_);
  if (!poses) return poses.error();
  truth.poses_ = std::move(*poses);
  return truth;
}

Result<Pose> Truth::at(int64_t stamp_ns) const {
  const auto after = std::lower_bound(poses_.begin(), poses_.end(), stamp_ns,
                                      [](const StampedPose& pose, int64_t stamp) { return pose.stamp_ns < stamp; });
  const StampedPose* nearest = nullptr;
  for (const auto& it : {after, after == poses_.begin() ? after : std::prev(after)})
    if (it != poses_.end() &&
        (nearest == nullptr || std::abs(it->stamp_ns - stamp_ns) < std::abs(nearest->stamp_ns - stamp_ns)))
      nearest = &*it;
  if (nearest == nullptr || std::abs(nearest->stamp_ns - stamp_ns) > kMaxAssociationGap_ns)
    return Error{ErrorCode::kBadData, name_ + ": no pose within 20 ms of stamp " + std::to_string(stamp_ns) + " ns"};
  return nearest->pose;
}

}  // namespace comap
