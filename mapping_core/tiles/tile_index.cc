#include "mapping_core/tiles/tile_index.h"

#include <algorithm>
#include <set>

#include "protocol/types/tile_distance.h"
#include "protocol/types/tile_revision.h"

namespace comap {
namespace {

constexpr double kViewCosine = 0.7;  // of half a camera's view, and some
constexpr double kNotAhead = 2;

// How far, in metres; the lower, the sooner.
double urgency(const TileKey& key, const Eigen::Vector3d& position_m, const Eigen::Vector3d& ahead) {
  const Eigen::Vector3d to = cornerOf(key) + Eigen::Vector3d::Constant(0.5 * double{kTileEdge_m}) - position_m;
  const double distance_m = to.norm();
  const bool in_view = to.dot(ahead) >= kViewCosine * distance_m;
  return in_view ? distance_m : kNotAhead * distance_m;
}

struct Candidate {
  double distance_m;
  uint64_t since;  // the lower, the longer it has been lacking: 0 if none is held, else the revision held, plus one
  const Tile* tile;
};

struct Order {
  std::vector<const Candidate*> all;
  size_t next = 0;
};

// Takes candidates by turns from three orders, as TileIndex::lacking() says.
std::vector<const Tile*> interleave(const std::vector<Candidate>& candidates) {
  uint64_t newest = 0;
  for (const Candidate& one : candidates) newest = std::max(newest, one.tile->revision);
  Order near, fresh;
  for (const Candidate& one : candidates) near.all.push_back(&one);
  std::stable_sort(near.all.begin(), near.all.end(),
                   [](const auto* a, const auto* b) { return a->distance_m < b->distance_m; });
  std::copy_if(near.all.begin(), near.all.end(), std::back_inserter(fresh.all),
               [&](const Candidate* one) { return one->tile->revision == newest; });
  Order overdue = near;
  std::stable_sort(overdue.all.begin(), overdue.all.end(),
                   [](const auto* a, const auto* b) { return a->since < b->since; });

  Order* const turns[] = {&near, &fresh, &near, &near, &fresh, &near, &overdue, &near};
  std::vector<bool> taken(candidates.size());
  std::vector<const Tile*> result;
  for (size_t turn = 0; result.size() < candidates.size(); ++turn) {
    Order& order = *turns[turn % std::size(turns)];
    const auto indexOfNext = [&] { return static_cast<size_t>(order.all[order.next] - candidates.data()); };
    while (order.next < order.all.size() && taken[indexOfNext()]) ++order.next;
    if (order.next == order.all.size()) continue;
    taken[indexOfNext()] = true;
    result.push_back(order.all[order.next]->tile);
  }
  return result;
}

}  // namespace

size_t TileIndex::update(const MapId& map, std::vector<Tile> tiles) {
  std::set<TileKey> present;
  for (Tile& tile : tiles) {
    tile.key.map = map;
    if (!tile.empty()) present.insert(tile.key);
  }
  for (const auto& [key, tile] : of(map))
    if (!tile.empty() && !present.contains(key)) tiles.push_back({key, 0});
  return change(map, std::move(tiles));
}

size_t TileIndex::change(const MapId& map, std::vector<Tile> tiles) {
  const uint64_t next = revision_ + kRevisionStep;
  size_t changed = 0;
  for (Tile& tile : tiles) {
    tile.key.map = map;
    const auto current = tiles_.find(tile.key);
    const bool known = current != tiles_.end();
    const bool same = known ? current->second.surfels == tile.surfels && current->second.places == tile.places
                            : tile.empty();  // who never held it need not know
    if (same) continue;
    tile.revision = next;
    const TileKey key = tile.key;
    tiles_.insert_or_assign(key, std::move(tile));
    ++changed;
  }
  if (changed > 0) revision_ = next;
  return changed;
}

void TileIndex::drop(const MapId& map) {
  std::erase_if(tiles_, [&](const auto& entry) { return entry.first.map == map; });
}

std::vector<TileDue> TileIndex::lacking(const MapId& map, const Pose& T_map_cam, double radius_m,
                                        std::span<const HeldTile> held) const {
  const Eigen::Vector3d position_m = T_map_cam.translation();
  const Eigen::Vector3d ahead = T_map_cam.rotation() * Eigen::Vector3d::UnitZ();
  std::vector<const HeldTile*> known;  // of this map, by key
  for (const HeldTile& tile : held)
    if (tile.key.map == map) known.push_back(&tile);
  const auto byKey = [](const HeldTile* a, const HeldTile* b) { return a->key < b->key; };
  if (!std::is_sorted(known.begin(), known.end(), byKey)) std::sort(known.begin(), known.end(), byKey);
  // Both are sorted: of each tile that there is, or was, or that the robot thinks there is, what both sides have.
  std::vector<TileDue> due;
  std::vector<Candidate> candidates;
  const auto tellGone = [&](const HeldTile& tile) { due.push_back({tile.key, revision_, true}); };
  auto next = known.begin();
  for (const auto& [key, tile] : of(map)) {
    for (; next != known.end() && (*next)->key < key; ++next) tellGone(**next);
    const HeldTile* its = next != known.end() && (*next)->key == key ? *next : nullptr;
    while (next != known.end() && (*next)->key == key) ++next;
    if (its != nullptr && its->revision == tile.revision) continue;  // it knows
    if (tile.empty()) {
      if (its != nullptr) due.push_back({key, tile.revision, true});
    } else if (distanceToTile(key, position_m) <= radius_m) {
      candidates.push_back({urgency(key, position_m, ahead), its == nullptr ? 0 : its->revision + 1, &tile});
    }
  }
  for (; next != known.end(); ++next) tellGone(**next);
  for (const Tile* tile : interleave(candidates)) due.push_back({tile->key, tile->revision});
  return due;
}

bool TileIndex::holds(const MapId& map) const { return !of(map).empty(); }

const Tile* TileIndex::find(const TileKey& key) const {
  const auto at = tiles_.find(key);
  return at == tiles_.end() || at->second.empty() ? nullptr : &at->second;
}

std::vector<Tile> TileIndex::tiles(const MapId& map) const {
  std::vector<Tile> result;
  for (const auto& [key, tile] : of(map))
    if (!tile.empty()) result.push_back(tile);
  return result;
}

}  // namespace comap
