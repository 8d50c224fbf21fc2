#include "fleet_tools/replay/contributor_order.h"

#include <algorithm>

namespace comap {

size_t orderOf(const std::vector<ReplayRobot>& robots, const std::string& name) {
  const auto found =
      std::find_if(robots.begin(), robots.end(), [&](const ReplayRobot& robot) { return robot.name == name; });
  return static_cast<size_t>(found - robots.begin());
}

std::vector<std::string> orderContributors(const std::vector<ReplayRobot>& robots,
                                           const std::vector<std::string>& arrived, std::vector<Surfel>& surfels) {
  constexpr size_t kBits = 32;
  for (Surfel& surfel : surfels) {
    uint32_t ordered = 0;
    for (size_t i = 0; i < std::min(arrived.size(), kBits); ++i)
      if (surfel.contributors >> i & 1) ordered |= 1u << (orderOf(robots, arrived[i]) % kBits);
    surfel.contributors = ordered;
  }
  std::vector<std::string> names;
  for (const ReplayRobot& robot : robots) names.push_back(robot.name);
  return names;
}

}  // namespace comap
