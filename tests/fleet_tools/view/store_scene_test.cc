#include "fleet_tools/view/store_scene.h"

#include <gtest/gtest.h>
#include <sqlite3.h>

#include "mapping_core/tiles/tile_builder.h"
#include "tests/files/temporary_folder.h"

namespace comap {
namespace {

const KeyframeId kKeyframe{"alpha", 5, 0};

std::vector<Tile> tilesOf(uint8_t red) {
  Surfel surfel;
  surfel.position = {0.3f, 0.2f, 1.1f};
  surfel.radius = 0.01f;
  surfel.confidence = 7;
  surfel.colour = {red, 20, 30};
  return buildTiles("alpha-5-0", std::vector<Surfel>(2, surfel), {});
}

class StoreSceneTest : public testing::Test {
 protected:
  void SetUp() override {
    auto made = MapStore::open(path_, MapStore::Mode::kCreateOrOpen);
    ASSERT_TRUE(made) << made.error().text;
    writer_.emplace(std::move(*made));
    ASSERT_TRUE(writer_->setMeta("version", "0.1.0"));
    ASSERT_TRUE(writer_->setMeta("complete", "no"));
    ASSERT_TRUE(*writer_->addKeyframe(kKeyframe, 1'500'000'000, std::vector<uint8_t>(1000)));
    ASSERT_TRUE(writer_->setPoses("alpha-5-0", {{kKeyframe, Pose()}}));
    ASSERT_TRUE(writer_->setTiles(tilesOf(10)));
  }

  void change(const std::string& sql) const {
    sqlite3* database = nullptr;
    ASSERT_EQ(sqlite3_open(path_.c_str(), &database), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(database, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(database);
    sqlite3_close(database);
  }

  // Tiles that a browser has not heard of yet.
  size_t newTiles() {
    size_t count = 0;
    for (FeedMessage message = feed_.next(cursor_); message.bytes; message = feed_.next(cursor_))
      count += message.binary;
    return count;
  }

  const TemporaryFolder folder_;
  const std::string path_ = folder_.path("map.comap");
  std::optional<MapStore> writer_;
  ViewFeed feed_;
  FeedCursor cursor_;
};

TEST_F(StoreSceneTest, ReadsWhatHasChanged) {
  auto scene = StoreScene::open(path_, true);
  ASSERT_TRUE(scene) << scene.error().text;
  EXPECT_TRUE(*scene->refresh(feed_));
  EXPECT_EQ(newTiles(), 1u);
  EXPECT_FALSE(*scene->refresh(feed_));
  ASSERT_TRUE(writer_->setTiles(tilesOf(200)));
  ASSERT_TRUE(writer_->setMeta("complete", "yes"));
  EXPECT_TRUE(*scene->refresh(feed_));
  EXPECT_TRUE(scene->site().complete);
  EXPECT_EQ(newTiles(), 1u);
}

TEST_F(StoreSceneTest, WhatCouldNotBeReadIsReadTheNextTime) {
  auto scene = StoreScene::open(path_, true);
  ASSERT_TRUE(scene) << scene.error().text;
  EXPECT_TRUE(*scene->refresh(feed_));
  EXPECT_EQ(newTiles(), 1u);
  ASSERT_TRUE(writer_->setTiles(tilesOf(200)));
  ASSERT_TRUE(writer_->setMeta("complete", "yes"));
  change("ALTER TABLE verdicts RENAME TO hidden");
  EXPECT_FALSE(scene->refresh(feed_));
  EXPECT_FALSE(scene->refresh(feed_)) << "nothing has changed, and it has not been read yet";
  EXPECT_EQ(newTiles(), 0u);
  change("ALTER TABLE hidden RENAME TO verdicts");
  const auto again = scene->refresh(feed_);
  ASSERT_TRUE(again) << again.error().text;
  EXPECT_TRUE(*again);
  EXPECT_EQ(newTiles(), 1u);
}

}  // namespace
}  // namespace comap
