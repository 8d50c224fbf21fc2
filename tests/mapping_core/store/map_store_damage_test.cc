#include <fcntl.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/wait.h>

#include <csignal>
#include <cstdio>

#include "tests/mapping_core/store/store_fixture.h"

namespace comap {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMessageBytes = 40000;  // whole pages, of which nothing is nobody's

class MapStoreDamageTest : public StoreTest {
 protected:
  void fill() {
    auto store = create();
    ASSERT_TRUE(store);
    for (uint32_t i = 0; i < 12; ++i) {
      ASSERT_TRUE(*store->addKeyframe(idOf(i), i, bytesOf(i, kMessageBytes)));
      ASSERT_TRUE(store->setPoses("m", {{idOf(i), poseOf(i)}}));
      if (i > 0) {
        ASSERT_TRUE(store->addEdge({idOf(i - 1), idOf(i), EdgeKind::kOdometry, poseOf(i), matrixOf(i)}));
      }
    }
    MatchVerdict verdict{idOf(1), idOf(2), true, "accepted", 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, poseOf(1), matrixOf(1)};
    ASSERT_TRUE(store->addVerdict(verdict));
    ASSERT_TRUE(store->addMerge({1, "a", "b", poseOf(1), {"alpha"}, {idOf(1)}, 3, {}}));
    std::vector<Tile> tiles;
    for (int i = 0; i < 6; ++i) tiles.push_back(tileOf("m", i, 0, 0, 800, uint32_t(i)));
    ASSERT_TRUE(store->setTiles(tiles));
  }
  void write(const std::string& content) { std::ofstream(path_, std::ios::binary) << content; }
  std::string content() {
    std::ifstream in(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  // Everything a reader can ask for. True if all of it came; each failure must be a known kind with the path in it.
  bool readAll() {
    auto store = read();
    if (!store) return check(store.error());
    bool fine = true;
    const auto note = [&](const auto& result) {
      if (!result) fine = check(result.error()) && fine;
    };
    const auto keyframes = store->keyframes();
    note(keyframes);
    for (uint32_t i = 0; i < 12; ++i) {
      const auto bytes = store->encodedKeyframe(idOf(i));
      if (!bytes) {
        fine = check(bytes.error()) && fine;
      } else {
        EXPECT_EQ(*bytes, bytesOf(i, kMessageBytes)) << "damage handed out as data";
      }
    }
    note(store->edges());
    note(store->verdicts());
    note(store->merges());
    const auto tiles = store->tiles("");
    note(tiles);
    if (tiles) {
      for (const Tile& tile : *tiles) {
        const auto expected = tileOf("m", tile.key.x, 0, 0, 800, uint32_t(tile.key.x));
        if (tile.key.x >= 0 && tile.key.x < 6) {
          EXPECT_EQ(tile.surfels, expected.surfels);
        }
      }
    }
    note(store->mapSizes());
    note(store->robots());
    note(store->meta("a"));
    return fine;
  }
  bool check(const Error& error) {
    EXPECT_TRUE(error.code == ErrorCode::kBadData || error.code == ErrorCode::kUnreachable ||
                error.code == ErrorCode::kWrongUse)
        << int(error.code) << " " << error.text;
    EXPECT_NE(error.text.find("map.comap"), std::string::npos) << error.text;
    return false;
  }
};

TEST_F(MapStoreDamageTest, aMissingFileIsNotMade) {
  const auto store = read();
  ASSERT_FALSE(store);
  EXPECT_EQ(store.error().code, ErrorCode::kUnreachable);
  EXPECT_EQ(store.error().text, path_.string() + ": no such file");
  EXPECT_TRUE(fs::is_empty(folder_));
  const auto elsewhere = MapStore::open(folder_ / "no" / "map.comap", MapStore::Mode::kCreateOrOpen);
  ASSERT_FALSE(elsewhere);
  EXPECT_EQ(elsewhere.error().code, ErrorCode::kUnreachable);
  EXPECT_EQ(MapStore::open(folder_, MapStore::Mode::kReadOnly).error().code, ErrorCode::kUnreachable);
}

TEST_F(MapStoreDamageTest, whatIsNoMapStoreIsLeftAlone) {
  const auto refuse = [&](const std::string& word) {
    const std::string before = content();
    for (const auto mode : {MapStore::Mode::kReadOnly, MapStore::Mode::kCreateOrOpen}) {
      const auto store = MapStore::open(path_, mode);
      ASSERT_FALSE(store);
      EXPECT_EQ(store.error().code, ErrorCode::kBadData) << store.error().text;
      EXPECT_NE(store.error().text.find(word), std::string::npos) << store.error().text;
    }
    EXPECT_EQ(content(), before);
  };
  write(std::string(5000, 'x'));
  refuse("not a database");
  fs::remove(path_);
  sql("PRAGMA application_id = 1234; CREATE TABLE t (a)");
  refuse("another application (application_id 0x000004d2");
  fs::remove(path_);
  sql("CREATE TABLE t (a)");
  refuse("another application");
  fs::remove(path_);
  fill();
  sql("PRAGMA user_version = 9");
  refuse("schema version 9 is newer than 4");

  write("");
  const auto empty = read();
  ASSERT_FALSE(empty);
  EXPECT_NE(empty.error().text.find("empty"), std::string::npos) << empty.error().text;
  EXPECT_TRUE(create()) << "an empty file may become a store";
}

TEST_F(MapStoreDamageTest, anyFlippedByteIsNoticedOrHarmless) {
  fill();
  const std::string good = content();
  ASSERT_TRUE(readAll());
  std::mt19937 engine(1);
  std::uniform_int_distribution<size_t> where(0, good.size() - 1);
  int noticed = 0;
  constexpr int kRounds = 400;
  for (int round = 0; round < kRounds; ++round) {
    std::string bad = good;
    const size_t at = where(engine);
    for (size_t i = at; i < std::min(bad.size(), at + size_t(1 + round % 40)); ++i) bad[i] = char(~bad[i]);
    write(bad);
    noticed += !readAll();
  }
  EXPECT_GT(noticed, kRounds / 2) << "most of the file is checked content";
}

TEST_F(MapStoreDamageTest, aTruncatedFileIsBadData) {
  fill();
  const std::string good = content();
  for (const double share : {0.999, 0.7, 0.4, 0.1, 0.01, 0.001}) {
    write(good.substr(0, size_t(share * double(good.size()))));
    EXPECT_FALSE(readAll()) << share;
  }
}

TEST_F(MapStoreDamageTest, hostileRowsAreRefusedByName) {
  const auto expectIn = [](const auto& result, const std::string& word) {
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, ErrorCode::kBadData);
    EXPECT_NE(result.error().text.find(word), std::string::npos) << result.error().text;
  };
  fill();
  sql("UPDATE tiles SET surfels = 1 << 40 WHERE x = 3");
  expectIn(read()->tiles(""), "claims 1099511627776 surfels");
  sql("UPDATE tiles SET surfels = -1 WHERE x = 3");
  expectIn(read()->tiles(""), "claims -1 surfels");
  sql("UPDATE tiles SET surfels = 801 WHERE x = 3");
  expectIn(read()->tiles(""), "holds 11200 bytes, expected 11214");
  sql("UPDATE keyframes SET sequence = -4 WHERE sequence = 4");
  expectIn(read()->keyframes(), "column sequence holds -4");
  sql("UPDATE keyframes SET sequence = 4 WHERE sequence = -4; UPDATE poses SET qw = 5 WHERE keyframe = 2");
  expectIn(read()->keyframes(), "quaternion");
  sql("PRAGMA ignore_check_constraints = 1; UPDATE edges SET kind = 'magic' WHERE number = 1");
  expectIn(read()->edges(), "'magic'");
  sql("DROP TABLE verdicts");
  expectIn(read()->verdicts(), "no such table");
}

// What goes wrong in `body`'s child process, as an exit code: 0 if all expectations of the child held.
template <class Body>
int inChild(Body body) {
  const pid_t child = fork();
  if (child == 0) _exit(body());
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + status;
}

TEST_F(MapStoreDamageTest, aFileThatMayNotGrowIsUnreachableAndLosesNothing) {
  ASSERT_TRUE(create());
  const int result = inChild([&] {
    signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{2 << 20, 2 << 20};
    if (setrlimit(RLIMIT_FSIZE, &limit) != 0) return 10;
    auto store = create();
    if (!store) return 11;
    for (uint32_t i = 0; i < 100; ++i) {
      const auto added = store->addKeyframe(idOf(i), 0, bytesOf(i, 100000));
      if (added) continue;
      if (added.error().code != ErrorCode::kUnreachable) return 12;
      return i > 5 && store->keyframes() && store->keyframes()->size() == i ? 0 : 13;
    }
    return 14;
  });
  EXPECT_EQ(result, 0);
  auto store = create();
  ASSERT_TRUE(store);
  const auto keyframes = store->keyframes();
  ASSERT_TRUE(keyframes);
  EXPECT_GT(keyframes->size(), 5u);
  for (const StoredKeyframe& k : *keyframes) EXPECT_EQ(*store->encodedKeyframe(k.id), bytesOf(k.id.sequence, 100000));
}

TEST_F(MapStoreDamageTest, aFullDiskIsSaidToBeFull) {
  const int result = inChild([&] {
    if (unshare(CLONE_NEWNS) != 0 || mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0) return 77;
    if (mount("tmpfs", folder_.c_str(), "tmpfs", 0, "size=3m") != 0) return 77;
    auto store = create();
    if (!store) return 11;
    for (uint32_t i = 0; i < 100; ++i) {
      const auto added = store->addKeyframe(idOf(i), 0, bytesOf(i, 100000));
      if (added) continue;
      std::printf("%s\n", added.error().text.c_str());
      std::fflush(stdout);
      if (added.error().code != ErrorCode::kUnreachable) return 12;
      if (added.error().text.find("no space left") == std::string::npos) return 13;
      return i > 5 && store->keyframes() && store->keyframes()->size() == i ? 0 : 14;
    }
    return 15;
  });
  if (result == 77) GTEST_SKIP() << "may not mount a small file system here";
  EXPECT_EQ(result, 0);
}

}  // namespace
}  // namespace comap
