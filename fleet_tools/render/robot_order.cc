#include "fleet_tools/render/robot_order.h"

#include <algorithm>

namespace comap {

std::vector<std::string> orderByName(std::span<const std::string> robots, std::span<const std::string> others) {
  std::vector<std::string> names(robots.begin(), robots.end()), after;
  std::sort(names.begin(), names.end());
  for (const std::string& other : others)
    if (!std::binary_search(names.begin(), names.end(), other)) after.push_back(other);
  std::sort(after.begin(), after.end());
  names.insert(names.end(), after.begin(), after.end());
  return names;
}

std::vector<size_t> placesByName(std::span<const std::string> robots) {
  const std::vector<std::string> names = orderByName(robots);
  std::vector<size_t> places;
  for (const std::string& robot : robots)
    places.push_back(static_cast<size_t>(std::lower_bound(names.begin(), names.end(), robot) - names.begin()));
  return places;
}

std::vector<std::string> orderContributors(std::span<const std::string> robots, std::vector<Surfel>& surfels) {
  constexpr size_t kBits = 32;
  const std::vector<size_t> places = placesByName(robots);
  for (Surfel& surfel : surfels) {
    uint32_t ordered = 0;
    for (size_t i = 0; i < std::min(places.size(), kBits); ++i)
      if (surfel.contributors >> i & 1) ordered |= 1u << (places[i] % kBits);
    surfel.contributors = ordered;
  }
  return orderByName(robots);
}

}  // namespace comap
