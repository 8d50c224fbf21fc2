// What browsers are shown, each part at its newest: sections of JSON and map tiles. Who is slow skips what was
// replaced.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "protocol/types/tile.h"

namespace comap {

/// In the order in which a new browser gets them.
enum class ViewSection : uint8_t { kSite, kRobots, kMaps, kKeyframes, kEdges, kTrails, kMerges, kVerdicts };
inline constexpr size_t kViewSections = 8;

/// One browser's place in the feed. All that is kept for it, however slow it is.
struct FeedCursor {
  std::array<uint64_t, kViewSections> sections{};
  uint64_t tiles = 0;
};

/// A message with kMessageHeadroom free bytes at its front.
struct FeedMessage {
  std::shared_ptr<std::vector<uint8_t>> bytes;
  bool binary = false;
};

/// Thread rule: one thread.
class ViewFeed {
 public:
  /// `json` is a whole document; nothing happens if it is what the section holds.
  void setSection(ViewSection section, const std::string& json);
  /// Replaces the tile of that key; one without surfels removes it.
  void setTile(const Tile& tile);
  /// Removes all tiles of `map` but those of `keep`.
  void dropTiles(const MapId& map, const std::set<TileKey>& keep = {});

  /// The next message that a browser lacks, newest content only; empty if it has all. Moves the cursor past it.
  FeedMessage next(FeedCursor& cursor) const;

  size_t tiles() const { return tiles_.size(); }

 private:
  struct Held {
    uint64_t change = 0;
    std::shared_ptr<std::vector<uint8_t>> message;
  };

  std::array<Held, kViewSections> sections_;
  std::map<TileKey, Held> tiles_;        // those removed too, so that browsers hear of it
  std::map<uint64_t, TileKey> journal_;  // each tile once, at its last change
  uint64_t changes_ = 0;
};

}  // namespace comap
