#include "fleet_tools/view/view_feed.h"

#include <gtest/gtest.h>

#include <cstring>

#include "fleet_tools/view/tile_message.h"

namespace comap {
namespace {

Tile tileAt(int x, uint64_t revision, size_t surfels, const MapId& map = "m") {
  return {{map, x, 0, 0}, revision, std::vector<TileSurfel>(surfels)};
}

struct Seen {
  std::vector<std::string> sections;
  std::vector<std::pair<int32_t, uint32_t>> tiles;  // x and number of surfels
};

Seen readAll(const ViewFeed& feed, FeedCursor& cursor) {
  Seen seen;
  for (FeedMessage message = feed.next(cursor); message.bytes; message = feed.next(cursor)) {
    const uint8_t* start = message.bytes->data() + kMessageHeadroom;
    if (!message.binary) {
      seen.sections.emplace_back(message.bytes->begin() + kMessageHeadroom, message.bytes->end());
      continue;
    }
    int32_t x = 0;
    uint32_t count = 0;
    std::memcpy(&x, start + 8, sizeof x);
    std::memcpy(&count, start + 4, sizeof count);
    seen.tiles.emplace_back(x, count);
  }
  return seen;
}

using Tiles = std::vector<std::pair<int32_t, uint32_t>>;

TEST(ViewFeed, ANewBrowserGetsAllOfItOnceAndThenWhatChanges) {
  ViewFeed feed;
  feed.setSection(ViewSection::kMerges, "{\"merges\":[]}");
  feed.setSection(ViewSection::kSite, "{\"site\":1}");
  feed.setTile(tileAt(1, 1, 5));
  feed.setTile(tileAt(2, 1, 6));
  FeedCursor cursor;
  const Seen first = readAll(feed, cursor);
  EXPECT_EQ(first.sections, (std::vector<std::string>{"{\"site\":1}", "{\"merges\":[]}"})) << "in the page's order";
  EXPECT_EQ(first.tiles, (Tiles{{1, 5}, {2, 6}}));
  EXPECT_TRUE(readAll(feed, cursor).tiles.empty());

  feed.setSection(ViewSection::kSite, "{\"site\":1}");
  feed.setTile(tileAt(2, 1, 6));
  const Seen nothing = readAll(feed, cursor);
  EXPECT_TRUE(nothing.sections.empty() && nothing.tiles.empty()) << "the same again is no change";

  feed.setSection(ViewSection::kSite, "{\"site\":2}");
  feed.setTile(tileAt(1, 2, 8));
  const Seen second = readAll(feed, cursor);
  EXPECT_EQ(second.sections, (std::vector<std::string>{"{\"site\":2}"}));
  EXPECT_EQ(second.tiles, (Tiles{{1, 8}}));
}

TEST(ViewFeed, WhoIsSlowSkipsWhatWasReplaced) {
  ViewFeed feed;
  feed.setTile(tileAt(1, 1, 1));
  feed.setTile(tileAt(2, 1, 1));
  FeedCursor slow, quick;
  feed.next(slow);  // tile 1
  for (uint64_t revision = 2; revision < 50; ++revision) {
    feed.setTile(tileAt(1, revision, revision));
    feed.setTile(tileAt(2, revision, revision));
    EXPECT_EQ(readAll(feed, quick).tiles.size(), 2u);
  }
  EXPECT_EQ(readAll(feed, slow).tiles, (Tiles{{1, 49}, {2, 49}}));
  EXPECT_EQ(feed.tiles(), 2u) << "nothing is kept of what was replaced";
}

TEST(ViewFeed, ATileThatIsNoMoreIsToldToThoseWhoHaveIt) {
  ViewFeed feed;
  feed.setTile(tileAt(1, 1, 5));
  feed.setTile(tileAt(2, 1, 5));
  feed.setTile(tileAt(7, 1, 5, "other"));
  feed.setTile(tileAt(9, 1, 0));  // never was
  FeedCursor cursor;
  EXPECT_EQ(readAll(feed, cursor).tiles.size(), 3u);
  feed.dropTiles("m", {{"m", 2, 0, 0}});
  EXPECT_EQ(readAll(feed, cursor).tiles, (Tiles{{1, 0}}));
  feed.setTile(tileAt(2, 2, 0));
  EXPECT_EQ(readAll(feed, cursor).tiles, (Tiles{{2, 0}}));
  feed.setTile(tileAt(1, 3, 4));
  EXPECT_EQ(readAll(feed, cursor).tiles, (Tiles{{1, 4}})) << "it may come back";
}

}  // namespace
}  // namespace comap
