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
  write("half");
  EXPECT_TRUE(prepareRunFolder(out_.string(), false));
  EXPECT_FALSE(fs::exists(out_ / "half"));
}

TEST_F(RunFolder, AFolderOfSomebodyElsesIsNeverEmptied) {
  fs::create_directories(out_);
  write("precious");
  EXPECT_FALSE(prepareRunFolder(out_.string(), true));
  EXPECT_TRUE(fs::exists(out_ / "precious"));
}

}  // namespace
}  // namespace comap
