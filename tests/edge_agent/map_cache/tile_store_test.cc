#include "edge_agent/map_cache/tile_store.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <random>
#include <set>
#include <thread>

#include "protocol/codec/codec.h"
#include "tests/files/temporary_folder.h"

namespace comap {
namespace {

// Surfels that follow from key and revision, and that zstd cannot shorten.
Tile tileOf(const MapId& map, int x, uint64_t revision, size_t surfels = 300) {
  Tile tile;
  tile.key = {map, x, 0, 0};
  tile.revision = revision;
  std::mt19937 random(static_cast<uint32_t>(x * 1000 + static_cast<int>(revision)));
  const auto byte = [&] { return static_cast<uint8_t>(random()); };
  for (size_t i = 0; i < surfels; ++i)
    tile.surfels.push_back({static_cast<uint16_t>(random()), static_cast<uint16_t>(random()),
                            static_cast<uint16_t>(random()), byte(), byte(), byte(), byte(), byte(), byte(), byte(),
                            byte()});
  return tile;
}

TileStore::Change changeOf(const Tile& tile) { return {tile.key, tile.revision, *encodeTile(tile)}; }

class TileStoreTest : public testing::Test {
 protected:
  TileStore open(uint64_t quota = 10'000'000) {
    auto store = openTileStore(path_, quota, [&](const std::string& line) { log_ += line + "\n"; });
    EXPECT_TRUE(store) << store.error().text;
    return std::move(*store);
  }
  static void write(TileStore& store, const std::vector<Tile>& tiles) {
    std::vector<TileStore::Change> changes;
    for (const Tile& tile : tiles) changes.push_back(changeOf(tile));
    const auto written = store.write(tiles.front().key.map, changes, Eigen::Vector3d::Zero());
    ASSERT_TRUE(written) << written.error().text;
  }

  TemporaryFolder folder_;
  const std::string path_ = folder_.path("a.tiles");
  std::string log_;
};

TEST_F(TileStoreTest, KeepsTilesOfSeveralMapsOverARestart) {
  {
    TileStore store = open();
    write(store, {tileOf("m", 1, 5), tileOf("m", -2, 6)});
    write(store, {tileOf("n", 1, 7)});
    write(store, {tileOf("m", 1, 8)});
  }
  TileStore store = open();
  EXPECT_EQ(*store.revisions("m"), (std::map<TileKey, uint64_t>{{{"m", 1, 0, 0}, 8}, {{"m", -2, 0, 0}, 6}}));
  EXPECT_EQ(*store.read({"m", 1, 0, 0}), tileOf("m", 1, 8));
  EXPECT_EQ(*store.read({"n", 1, 0, 0}), tileOf("n", 1, 7));
  EXPECT_TRUE(store.revisions("other")->empty());
  const uint64_t bytes = store.bytes();
  const std::vector<TileStore::Change> removal(1, {{"m", 1, 0, 0}, 9, {}});
  ASSERT_TRUE(store.write("m", removal, Eigen::Vector3d::Zero()));
  EXPECT_EQ(store.revisions("m")->size(), 1u);
  EXPECT_LT(store.bytes(), bytes);
  EXPECT_EQ(log_, "");
}

TEST_F(TileStoreTest, GrowsNoLargerThanItsQuotaAndLosesWhatIsOldAndFarFirst) {
  constexpr uint64_t kQuota = 2'000'000;
  TileStore store = open(kQuota);
  for (const char* map : {"old", "older", "m"}) {
    std::vector<Tile> tiles;
    for (int x = 0; x < 60; ++x) tiles.push_back(tileOf(map, x, 1));  // 4.4 kB each
    write(store, tiles);
  }
  ASSERT_TRUE(store.revisions("older"));  // used now
  ASSERT_TRUE(store.revisions("m"));
  for (int x = 60; x < 190; ++x) write(store, {tileOf("m", x, 1)});
  EXPECT_EQ(store.revisions("old")->size(), 0u);
  EXPECT_EQ(store.revisions("older")->size(), 60u);
  for (int x = 190; x < 900; ++x) write(store, {tileOf("m", 1000 - x, 2)});
  EXPECT_EQ(store.revisions("older")->size(), 0u);
  const auto left = *store.revisions("m");
  EXPECT_GT(left.size(), 150u);
  for (const auto& [key, revision] : left) {
    EXPECT_LT(key.x, 700) << "the farthest went first";
    ASSERT_TRUE(store.read(key));
  }
  EXPECT_LE(store.bytes(), kQuota);
  { TileStore closed = std::move(store); }
  EXPECT_LE(std::filesystem::file_size(path_), kQuota);
}

TEST_F(TileStoreTest, WhatDoesNotFitAtAllIsNotTaken) {
  TileStore store = open(200'000);
  std::vector<TileStore::Change> changes;
  for (int x = 0; x < 100; ++x) changes.push_back(changeOf(tileOf("m", x, 1)));
  const auto gone = store.write("m", changes, Eigen::Vector3d::Zero());
  ASSERT_TRUE(gone) << gone.error().text;
  const auto there = *store.revisions("m");
  EXPECT_GT(there.size(), 10u);
  EXPECT_EQ(there.size() + gone->size(), 100u);
  EXPECT_LE(store.bytes(), 200'000u);
}

TEST_F(TileStoreTest, AKilledProcessLeavesWholeTiles) {
  for (int round = 0; round < 8; ++round) {
    int written[2];
    ASSERT_EQ(pipe(written), 0);
    const pid_t child = fork();
    if (child == 0) {
      auto store = TileStore::open(path_, 3'000'000);
      for (uint64_t revision = 1; store; ++revision) {
        std::vector<TileStore::Change> changes;
        for (int x = 0; x < 20; ++x)
          changes.push_back(changeOf(tileOf("m", x, revision + 100 * static_cast<uint64_t>(round))));
        if (!store->write("m", changes, Eigen::Vector3d::Zero())) _exit(1);
        if (revision == 1 && ::write(written[1], "1", 1) != 1) _exit(1);
      }
      _exit(1);
    }
    close(written[1]);
    char first = 0;
    EXPECT_EQ(::read(written[0], &first, 1), 1) << "it could not open or write";
    close(written[0]);
    std::this_thread::sleep_for(std::chrono::milliseconds(17 * round));
    kill(child, SIGKILL);
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status)) << "it could not open or write";
    TileStore store = open();
    const auto there = *store.revisions("m");
    std::set<uint64_t> revisions;
    for (const auto& [key, revision] : there) {
      const auto tile = store.read(key);
      ASSERT_TRUE(tile) << tile.error().text;
      EXPECT_EQ(*tile, tileOf("m", key.x, revision));
      revisions.insert(revision);
    }
    EXPECT_EQ(there.size(), 20u);
    EXPECT_EQ(revisions.size(), 1u) << "all changes of one write, or none";
    EXPECT_EQ(log_, "");
  }
}

// A byte changed anywhere: a tile is what was written, or the file is refused; never another surface.
TEST_F(TileStoreTest, DamageIsNoticedAndDropped) {
  {
    TileStore store = open();
    std::vector<Tile> tiles;
    for (int x = 0; x < 12; ++x) tiles.push_back(tileOf("m", x, 3));
    write(store, tiles);
  }
  const std::string whole = contentOf(path_);
  std::mt19937 random(1);
  int noticed = 0;
  for (int round = 0; round < 50; ++round) {
    std::string bytes = whole;
    if (round % 5 == 0)
      bytes.resize(random() % whole.size());
    else
      for (int i = 0; i < 3; ++i) bytes[random() % whole.size()] = static_cast<char>(random());
    std::ofstream(path_, std::ios::binary | std::ios::trunc) << bytes;
    log_.clear();
    auto store = openTileStore(path_, 10'000'000, [&](const std::string& line) { log_ += line; });
    if (!log_.empty()) ++noticed;
    if (!store) {
      ++noticed;
      removeTileStore(path_);
      continue;
    }
    const auto there = store->revisions("m");
    noticed += !there;
    if (there)
      for (const auto& [key, revision] : *there) {
        const auto tile = store->read(key);
        noticed += !tile;
        if (!tile) continue;
        EXPECT_EQ(*tile, tileOf("m", key.x, 3));
      }
    { TileStore closed = std::move(*store); }
    removeTileStore(path_);
  }
  EXPECT_GT(noticed, 20);
}

TEST_F(TileStoreTest, AFileThatIsNoDatabaseIsDroppedWithASentence) {
  std::ofstream(path_) << std::string(5000, 'x');
  TileStore store = open();
  EXPECT_NE(log_.find(path_), std::string::npos) << log_;
  EXPECT_TRUE(store.revisions("m")->empty());
}

TEST_F(TileStoreTest, SomebodyElsesDatabaseIsLeftAlone) {
  {
    auto other = Database::open(path_, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
    ASSERT_TRUE(other->execute("CREATE TABLE mine(x)"));
    ASSERT_TRUE(other->execute("PRAGMA application_id = 7"));
  }
  const std::string before = contentOf(path_);
  const auto store = openTileStore(path_, 1'000'000, [](const std::string&) {});
  ASSERT_FALSE(store);
  EXPECT_EQ(store.error().code, ErrorCode::kProblem);
  EXPECT_TRUE(contentOf(path_) == before) << "to the byte";
  auto other = Database::open(path_, SQLITE_OPEN_READWRITE);
  EXPECT_EQ(*other->integer("SELECT count(*) FROM mine"), 0);
}

TEST_F(TileStoreTest, WhatIsNoFileIsNamed) {
  std::filesystem::create_directory(path_);
  const auto store = openTileStore(path_, 1'000'000, [](const std::string&) {});
  ASSERT_FALSE(store);
  EXPECT_EQ(store.error().code, ErrorCode::kUnreachable);
  EXPECT_NE(store.error().text.find("is a folder, expected a regular file"), std::string::npos) << store.error().text;
  EXPECT_TRUE(std::filesystem::is_directory(path_)) << "left as it is";
}

TEST_F(TileStoreTest, TwoAgentsDoNotShareAFile) {
  TileStore store = open();
  write(store, {tileOf("m", 1, 1)});
  const auto second = TileStore::open(path_, 1'000'000);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::kUnreachable) << second.error().text;
}

}  // namespace
}  // namespace comap
