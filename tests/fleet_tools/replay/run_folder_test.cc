#include "fleet_tools/replay/run_folder.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace comap {
namespace {

namespace fs = std::filesystem;

class RunFolder : public testing::Test {
 protected:
  void SetUp() override { fs::remove_all(out_); }
  void TearDown() override { fs::remove_all(out_); }
  void write(const std::string& name) const { std::ofstream(out_ / name) << "{}"; }
  const fs::path out_ = fs::temp_directory_path() / ("comap-run-" + std::to_string(getpid()));
};

TEST_F(RunFolder, ARunWithoutAStoreIsKeptToo) {
  ASSERT_TRUE(prepareRunFolder(out_.string(), false));
  write("report.json");
  const auto refused = prepareRunFolder(out_.string(), false);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kWrongUse);
  EXPECT_TRUE(fs::exists(out_ / "report.json"));
  EXPECT_TRUE(prepareRunFolder(out_.string(), true));
  EXPECT_FALSE(fs::exists(out_ / "report.json"));
}

TEST_F(RunFolder, AlsoWhereRunsLieInFolders) {
  ASSERT_TRUE(prepareRunFolder(out_.string(), false));
  ASSERT_TRUE(prepareRunFolder((out_ / "seed-1").string(), false));
  write("seed-1/report.json");
  EXPECT_FALSE(prepareRunFolder(out_.string(), false));
  EXPECT_TRUE(fs::exists(out_ / "seed-1/report.json"));
}

TEST_F(RunFolder, WhatAFailedStartLeftIsReplaced) {
  ASSERT_TRUE(prepareRunFolder(out_.string(), false));
  write("events.log");
  EXPECT_TRUE(prepareRunFolder(out_.string(), false));
  EXPECT_FALSE(fs::exists(out_ / "events.log"));
}

TEST_F(RunFolder, OnlyWhatARunWroteIsEverRemoved) {
  for (const std::string foreign : {"notes.txt", "seed-1/notes.txt", "logs/notes.txt", "etc/passwd", "map.comap.bak",
                                    "map.comap.saved", "notes.part-2.txt", "notes.txt.part", "map.png.part-x",
                                    "map.png.part-", "map.comap.part-7-wal"}) {
    fs::remove_all(out_);
    ASSERT_TRUE(prepareRunFolder(out_.string(), false));
    ASSERT_TRUE(prepareRunFolder((out_ / "seed-1").string(), false));
    write("report.json");
    fs::create_directories((out_ / foreign).parent_path());
    write(foreign);
    const auto refused = prepareRunFolder(out_.string(), true);
    ASSERT_FALSE(refused) << foreign;
    EXPECT_EQ(refused.error().code, ErrorCode::kWrongUse);
    EXPECT_NE(refused.error().text.find((out_ / foreign).parent_path().string()), std::string::npos)
        << refused.error().text;
    EXPECT_TRUE(fs::exists(out_ / foreign));
    EXPECT_TRUE(fs::exists(out_ / "report.json")) << "nothing is removed";
  }
}

TEST_F(RunFolder, ALinkIsNotFollowed) {
  ASSERT_TRUE(prepareRunFolder(out_.string(), false));
  const fs::path elsewhere = out_.string() + "-elsewhere";
  ASSERT_TRUE(prepareRunFolder(elsewhere.string(), false));
  std::ofstream(elsewhere / "report.json") << "{}";
  fs::create_directory_symlink(elsewhere, out_ / "seed-1");
  EXPECT_FALSE(prepareRunFolder(out_.string(), true));
  EXPECT_TRUE(fs::exists(elsewhere / "report.json"));
  fs::remove_all(elsewhere);
}

TEST_F(RunFolder, LogsAndRunsWithinGoWithIt) {
  ASSERT_TRUE(prepareRunFolder(out_.string(), false));
  ASSERT_TRUE(prepareRunFolder((out_ / "paper").string(), false));
  fs::create_directories(out_ / "logs");
  for (const char* name : {"logs/core.log", "logs/a.json", "logs/config.yaml", "logs/a.json.part", "a.trajectory.txt",
                           "map.comap", "map.comap-wal", "map.comap-shm", "report.json.part", "map.ply.part-712",
                           "paper/frames.csv", "report.json"})
    write(name);
  ASSERT_TRUE(prepareRunFolder(out_.string(), true));
  EXPECT_EQ(std::distance(fs::directory_iterator(out_), {}), 1) << "the mark alone";
}

TEST_F(RunFolder, ANameThatIsNoFolderIsRefused) {
  EXPECT_FALSE(prepareRunFolder("", true)) << "and marks nothing";
  EXPECT_FALSE(fs::exists("/.comap-run"));
  std::ofstream(out_.string()) << "a file";
  EXPECT_FALSE(prepareRunFolder(out_.string(), true));
  EXPECT_TRUE(fs::is_regular_file(out_));
}

TEST_F(RunFolder, AFolderOfSomebodyElsesIsNeverEmptied) {
  fs::create_directories(out_);
  write("precious");
  EXPECT_FALSE(prepareRunFolder(out_.string(), true));
  EXPECT_TRUE(fs::exists(out_ / "precious"));
}

}  // namespace
}  // namespace comap
