#include "protocol/storage/leaf_rows.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <random>

#include "protocol/storage/database.h"
#include "tests/files/damaged_database.h"
#include "tests/files/temporary_folder.h"

namespace comap {
namespace {

using Kind = LeafRow::Column::Kind;

// A table of blobs of all sizes that stand differently: empty, within a page, about as large as one, in chains.
class LeafRowsTest : public testing::Test {
 protected:
  void make(int page_bytes = 4096) {
    auto database = Database::open(path_, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
    ASSERT_TRUE(database->execute("PRAGMA page_size = " + std::to_string(page_bytes)));
    ASSERT_TRUE(database->execute("CREATE TABLE blobs (number INTEGER, blob BLOB, word TEXT, real REAL)"));
    std::mt19937 random(1);
    for (const size_t size :
         {0u, 1u, 100u, 480u, 489u, 500u, 4000u, 4030u, 4061u, 4062u, 4100u, 8180u, 70000u, 300000u})
      for (const int64_t number : {int64_t{0}, int64_t{1}, int64_t{-1}, int64_t{200}, int64_t{-40000}, int64_t{1} << 23,
                                   int64_t{1} << 40, -(int64_t{1} << 62)}) {
        auto& blob = blobs_[{number, size}];
        for (size_t i = 0; i < size; ++i) blob.push_back(static_cast<uint8_t>(random()));
        auto insert = database->query("INSERT INTO blobs VALUES (?, ?, 'word', 0.5)");
        ASSERT_TRUE(insert->bind(number).bind(std::span<const uint8_t>(blob)).run());
      }
  }
  // Those rows that are read and are right.
  size_t readable() const {
    auto rows = LeafRows::open(path_);
    if (!rows) return 0;
    std::vector<LeafRow> found;
    rows->each([&](const LeafRow& row) { found.push_back(row); });
    std::set<std::pair<int64_t, size_t>> right;
    for (const LeafRow& row : found) {
      if (row.columns.size() < 2) continue;
      const auto known = blobs_.find({row.columns[0].integer, row.columns[1].size});
      if (known != blobs_.end() && rows->blob(row, 1) == known->second) right.insert(known->first);
    }
    return right.size();
  }

  TemporaryFolder folder_;
  const std::string path_ = folder_ / "file.db";
  std::map<std::pair<int64_t, size_t>, std::vector<uint8_t>> blobs_;
};

TEST_F(LeafRowsTest, ReadsEachRowOfAFileOfAnyPageSize) {
  for (const int page_bytes : {512, 4096, 65536}) {
    std::filesystem::remove(path_);
    blobs_.clear();
    make(page_bytes);
    EXPECT_EQ(readable(), blobs_.size()) << page_bytes;
  }
}

TEST_F(LeafRowsTest, TellsColumnsByTheirKinds) {
  make();
  auto rows = LeafRows::open(path_);
  ASSERT_TRUE(rows) << rows.error().text;
  size_t seen = 0;
  rows->each([&](const LeafRow& row) {
    ++seen;
    ASSERT_EQ(row.columns.size(), 4u);
    EXPECT_EQ(row.columns[0].kind, Kind::kInteger);
    EXPECT_EQ(row.columns[1].kind, Kind::kBlob);
    EXPECT_EQ(row.columns[2].kind, Kind::kOther);
    EXPECT_EQ(row.columns[2].size, 4u);
    EXPECT_EQ(row.columns[3].kind, Kind::kOther);
    EXPECT_EQ(row.columns[3].size, 8u);
  });
  EXPECT_EQ(seen, blobs_.size());
}

TEST_F(LeafRowsTest, NeedsNoPageAboveTheLeaves) {
  make();
  wipePage(path_, rootPageOf(path_, "blobs"));
  EXPECT_EQ(readable(), blobs_.size());
}

TEST_F(LeafRowsTest, OfDamagedPagesNothingFalseIsTaken) {
  make();
  const auto whole = folder_ / "whole";
  std::filesystem::copy_file(path_, whole);
  std::mt19937 random(2);
  const auto bytes = std::filesystem::file_size(path_);
  for (int round = 0; round < 30; ++round) {
    std::filesystem::copy_file(whole, path_, std::filesystem::copy_options::overwrite_existing);
    std::fstream file(path_, std::ios::in | std::ios::out | std::ios::binary);
    for (int i = 0; i < 300; ++i) {
      file.seekp(static_cast<std::streamoff>(100 + random() % (bytes - 100)));
      file.put(static_cast<char>(random()));
    }
    file.close();
    EXPECT_GT(readable(), blobs_.size() / 10);
    if (round % 3 == 0) std::filesystem::resize_file(path_, bytes / 2);
    EXPECT_LE(readable(), blobs_.size());
  }
}

TEST_F(LeafRowsTest, WhatIsNoDatabaseIsAnError) {
  EXPECT_EQ(LeafRows::open(folder_ / "none").error().code, ErrorCode::kUnreachable);
  folder_.write("text", std::string(5000, 'x'));
  EXPECT_EQ(LeafRows::open(folder_ / "text").error().code, ErrorCode::kBadData);
  folder_.write("empty", "");
  EXPECT_FALSE(LeafRows::open(folder_ / "empty"));
}

}  // namespace
}  // namespace comap
