// A folder that goes with the test, and records to put into a store.
#pragma once

#include <gtest/gtest.h>
#include <sqlite3.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "mapping_core/store/map_store.h"
#include "protocol/storage/row_sum.h"

namespace comap {

inline constexpr size_t kNewPageBytes = 16384;   // of stores that are made now
inline constexpr size_t kSmallPageBytes = 4096;  // of those of earlier releases

class StoreTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "comap_store_XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    path_ = folder_ / "map.comap";
  }
  void TearDown() override {
    std::error_code code;
    std::filesystem::remove_all(folder_, code);
  }

  Result<MapStore> create() { return MapStore::open(path_, MapStore::Mode::kCreateOrOpen); }
  Result<MapStore> read() { return MapStore::open(path_, MapStore::Mode::kReadOnly); }

  // The store that is made there has pages as those of earlier releases.
  static void makeSmallPages(const std::filesystem::path& path) {
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open(path.c_str(), &db), SQLITE_OK);
    static_assert(kSmallPageBytes == 4096);
    const char* pages = "PRAGMA page_size = 4096; PRAGMA journal_mode = WAL";
    ASSERT_EQ(sqlite3_exec(db, pages, nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(db);
    sqlite3_close(db);
  }

  // Changes what no program would.
  void sql(const char* statement) {
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open(path_.c_str(), &db), SQLITE_OK);
    ASSERT_EQ(addRowSum(db), SQLITE_OK);
    ASSERT_EQ(sqlite3_exec(db, statement, nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(db);
    sqlite3_close(db);
  }

  static KeyframeId idOf(uint32_t sequence, const std::string& robot = "alpha") {
    return {robot, 0xfedcba9876543210ull, sequence};
  }
  static std::vector<uint8_t> bytesOf(uint32_t seed, size_t size) {
    std::mt19937 engine(seed);
    std::vector<uint8_t> bytes(size);
    for (uint8_t& byte : bytes) byte = uint8_t(engine());
    return bytes;
  }
  static Pose poseOf(uint32_t seed) {
    std::mt19937 engine(seed);
    std::uniform_real_distribution<double> any(-1, 1);
    Vector6d twist;
    for (int i = 0; i < 6; ++i) twist(i) = any(engine);
    return Pose::exp(twist);
  }
  static Matrix6d matrixOf(uint32_t seed) {
    std::mt19937 engine(seed);
    std::normal_distribution<double> any(0, 1e3);
    Matrix6d m;
    for (int i = 0; i < 36; ++i) m(i / 6, i % 6) = any(engine);
    return m;
  }
  static Tile tileOf(const MapId& map, int x, int y, int z, size_t surfels, uint32_t seed) {
    Tile tile;
    tile.key = {map, x, y, z};
    tile.revision = seed;
    std::mt19937 engine(seed);
    for (size_t i = 0; i < surfels; ++i) {
      const auto u16 = [&] { return uint16_t(engine()); };
      const auto u8 = [&] { return uint8_t(engine()); };
      tile.surfels.push_back({u16(), u16(), u16(), u8(), u8(), u8(), u8(), u8(), u8(), u8(), u8()});
    }
    return tile;
  }
  // Equal but for the last bit of a quaternion, which Pose normalises.
  static void expectSame(const Pose& a, const Pose& b) {
    EXPECT_EQ(a.translation(), b.translation());
    EXPECT_LT((a.rotation().coeffs() - b.rotation().coeffs()).norm(), 1e-15);
  }

  std::filesystem::path folder_, path_;
};

}  // namespace comap
