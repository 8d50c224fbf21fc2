#include "fleet_tools/view/tile_asking.h"

#include <cmath>
#include <iterator>

namespace comap {
namespace {

constexpr double kEverywhere_m = 1e5, kRegion_m = 40, kSmaller = 0.7;
constexpr double kGoldenStep = 0.6180339887498949;  // its multiples come near to every place soon
constexpr size_t kFreshShare = 4;                   // of a message

Eigen::Vector3d centreOf(const TileKey& key) {
  return Eigen::Vector3d(key.x + 0.5, key.y + 0.5, key.z + 0.5) * double{kTileEdge_m};
}

}  // namespace

void TileAsking::took(const TileKey& key, uint64_t revision) {
  fresh_.push_back({key, revision});
  if (fresh_.size() > most_ / kFreshShare) fresh_.pop_front();
}

TileAsking::Question TileAsking::next(const std::map<TileKey, Tile>& tiles, const Eigen::Vector3d& viewer_m) {
  if (tiles.size() <= most_) {
    Question all{viewer_m, kEverywhere_m, {}};
    for (const auto& [key, tile] : tiles) all.held.push_back({key, tile.revision});
    return all;
  }
  place_ = std::fmod(place_ + kGoldenStep, 1.0);
  const auto at = std::next(tiles.begin(), static_cast<ptrdiff_t>(place_ * static_cast<double>(tiles.size())));
  Question region{centreOf(at->first), kRegion_m, {}};
  const size_t room = most_ - fresh_.size();
  for (;; region.radius_m *= kSmaller) {
    region.held.clear();
    // Half a diagonal more: the core asks how far the tile is, not its centre.
    const double reach_m = region.radius_m + double{kTileEdge_m};
    for (const auto& [key, tile] : tiles)
      if ((centreOf(key) - region.centre_m).squaredNorm() <= reach_m * reach_m && region.held.size() <= room)
        region.held.push_back({key, tile.revision});
    if (region.held.size() <= room) break;
  }
  region.held.insert(region.held.end(), fresh_.begin(), fresh_.end());
  return region;
}

}  // namespace comap
