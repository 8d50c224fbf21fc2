#include "fleet_tools/view/view_feed.h"

#include <algorithm>

#include "fleet_tools/view/tile_message.h"

namespace comap {

void ViewFeed::setSection(ViewSection section, const std::string& json) {
  Held& held = sections_[static_cast<size_t>(section)];
  std::vector<uint8_t> bytes(kMessageHeadroom);
  bytes.insert(bytes.end(), json.begin(), json.end());
  if (held.message && *held.message == bytes) return;
  held = {++changes_, std::make_shared<std::vector<uint8_t>>(std::move(bytes))};
}

void ViewFeed::setTile(const Tile& tile) {
  if (tile.surfels.empty() && !tiles_.contains(tile.key)) return;
  auto message = std::make_shared<std::vector<uint8_t>>(tileMessage(tile));
  Held& held = tiles_[tile.key];
  if (held.message && *held.message == *message) return;
  journal_.erase(held.change);
  held = {++changes_, std::move(message)};
  journal_.emplace(held.change, tile.key);
}

void ViewFeed::dropTiles(const MapId& map, const std::set<TileKey>& keep) {
  std::vector<TileKey> gone;
  for (const auto& [key, held] : tiles_)
    if (key.map == map && !keep.contains(key)) gone.push_back(key);
  for (const TileKey& key : gone) setTile({key});
}

FeedMessage ViewFeed::next(FeedCursor& cursor) const {
  for (size_t i = 0; i < kViewSections; ++i) {
    if (sections_[i].change <= cursor.sections[i]) continue;
    cursor.sections[i] = sections_[i].change;
    return {sections_[i].message, false};
  }
  const auto it = journal_.upper_bound(cursor.tiles);
  if (it == journal_.end()) return {};
  cursor.tiles = it->first;
  return {tiles_.at(it->second).message, true};
}

}  // namespace comap
