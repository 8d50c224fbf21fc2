#include "mapping_core/tiles/tile_index.h"

#include <algorithm>
#include <limits>
#include <set>

#include "protocol/types/tile_distance.h"

namespace comap {
namespace {

constexpr double kViewCosine = 0.7;  // of half a camera's view, and some
constexpr double kNotAhead = 2;
constexpr size_t kBytesPerSurfel = 14;
constexpr size_t kBytesPerTile = 64;  // key, revision, framing
constexpr size_t kBytesPerPose = 70;  // of a place

TileKey firstKeyOf(const MapId& map) {
  constexpr int32_t kLow = std::numeric_limits<int32_t>::min();
  return {map, kLow, kLow, kLow};
}

size_t sizeOnTheWire(const Tile& tile) {
  size_t bytes = kBytesPerTile + kBytesPerSurfel * tile.surfels.size();
  for (const TilePlace& place : tile.places) bytes += kBytesPerPose + place.code.codes.size() * 5 / 8;
  return bytes;
}

// How far, in metres; the lower, the sooner.
double urgency(const TileKey& key, const Eigen::Vector3d& position_m, const Eigen::Vector3d& ahead) {
  const Eigen::Vector3d to = cornerOf(key) + Eigen::Vector3d::Constant(0.5 * double{kTileEdge_m}) - position_m;
  const double distance_m = to.norm();
  const bool in_view = to.dot(ahead) >= kViewCosine * distance_m;
  return in_view ? distance_m : kNotAhead * distance_m;
}

}  // namespace

size_t TileIndex::update(const MapId& map, std::vector<Tile> tiles) {
  const uint64_t next = revision_ + 1;
  size_t changed = 0;
  std::set<TileKey> present;
  for (Tile& tile : tiles) {
    if (tile.empty()) continue;
    tile.key.map = map;
    present.insert(tile.key);
    Tile& current = tiles_[tile.key];
    if (current.surfels == tile.surfels && current.places == tile.places) continue;
    tile.revision = next;
    current = std::move(tile);
    ++changed;
  }
  for (auto at = tiles_.lower_bound(firstKeyOf(map)); at != tiles_.end() && at->first.map == map; ++at) {
    Tile& tile = at->second;
    if (tile.empty() || present.contains(at->first)) continue;
    tile.surfels.clear();
    tile.surfels.shrink_to_fit();
    tile.places.clear();
    tile.revision = next;
    ++changed;
  }
  if (changed > 0) revision_ = next;
  return changed;
}

void TileIndex::drop(const MapId& map) {
  std::erase_if(tiles_, [&](const auto& entry) { return entry.first.map == map; });
}

std::vector<Tile> TileIndex::lacking(const MapId& map, const Pose& T_map_cam, double radius_m,
                                     std::span<const HeldTile> held, size_t budget_bytes) const {
  const Eigen::Vector3d position_m = T_map_cam.translation();
  const Eigen::Vector3d ahead = T_map_cam.rotation() * Eigen::Vector3d::UnitZ();
  std::map<TileKey, uint64_t> held_revision;
  for (const HeldTile& tile : held) {
    if (tile.key.map == map) held_revision[tile.key] = tile.revision;
  }

  std::vector<Tile> removals;
  for (const auto& [key, revision] : held_revision) {
    const auto found = tiles_.find(key);
    if (found == tiles_.end()) {
      removals.push_back({key, revision_, {}});
    } else if (found->second.empty() && found->second.revision != revision) {  // else it knows
      removals.push_back(found->second);
    }
  }

  struct Candidate {
    double distance;
    const Tile* tile;
  };
  std::vector<Candidate> candidates;
  for (auto at = tiles_.lower_bound(firstKeyOf(map)); at != tiles_.end() && at->first.map == map; ++at) {
    if (at->second.empty() || !(distanceToTile(at->first, position_m) <= radius_m)) continue;
    const auto known = held_revision.find(at->first);
    if (known != held_revision.end() && known->second == at->second.revision) continue;
    candidates.push_back({urgency(at->first, position_m, ahead), &at->second});
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.distance < b.distance; });

  std::vector<Tile> result;
  size_t bytes = 0;
  const auto fits = [&](const Tile& tile) {
    bytes += sizeOnTheWire(tile);
    return result.empty() || bytes <= budget_bytes;
  };
  for (Tile& tile : removals) {
    if (!fits(tile)) return result;
    result.push_back(std::move(tile));
  }
  for (const Candidate& candidate : candidates) {
    if (!fits(*candidate.tile)) return result;
    result.push_back(*candidate.tile);
  }
  return result;
}

bool TileIndex::holds(const MapId& map) const {
  const auto at = tiles_.lower_bound(firstKeyOf(map));
  return at != tiles_.end() && at->first.map == map;
}

std::vector<Tile> TileIndex::tiles(const MapId& map) const {
  std::vector<Tile> result;
  for (auto at = tiles_.lower_bound(firstKeyOf(map)); at != tiles_.end() && at->first.map == map; ++at) {
    if (!at->second.empty()) result.push_back(at->second);
  }
  return result;
}

}  // namespace comap
