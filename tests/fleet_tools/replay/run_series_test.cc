#include "fleet_tools/replay/run_series.h"

#include <gtest/gtest.h>

#include <fstream>

#include "fleet_tools/replay/run_folder.h"
#include "tests/files/temporary_folder.h"

namespace comap {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

class RunSeriesTest : public testing::Test {
 protected:
  void write(const std::string& name) const { std::ofstream(fs::path(out_) / name) << "{}"; }
  bool there(const std::string& name) const { return fs::exists(fs::path(out_) / name); }
  // A first program that finished one of two runs.
  void finishOne() const {
    auto series = RunSeries::begin(out_, plan_, false);
    ASSERT_TRUE(series) << series.error().text;
    EXPECT_EQ(series->finishedBefore(), 0u);
    ASSERT_TRUE(series->addFolder(out_ + "/alone-a"));
    for (const char* name : {"alone-a/graph", "seed-2"})
      EXPECT_EQ(*series->takeUp(out_ + "/" + name), std::nullopt) << name;
    write("alone-a/graph/report.json");
    write("seed-2/report.json");
    ASSERT_TRUE(series->finish(out_ + "/alone-a/graph", 1));
  }

  TemporaryFolder folder_;
  const std::string out_ = folder_.path("run");
  const json plan_ = {{"robots", {"a=one"}}, {"mode", "graph"}};
};

TEST_F(RunSeriesTest, WhatIsFinishedIsKeptAndTheOthersBeginAnew) {
  finishOne();
  auto series = RunSeries::begin(out_, plan_, false);
  ASSERT_TRUE(series) << series.error().text;
  EXPECT_EQ(series->finishedBefore(), 1u);
  ASSERT_TRUE(series->addFolder(out_ + "/alone-a"));
  EXPECT_EQ(*series->takeUp(out_ + "/alone-a/graph"), std::optional(1));
  EXPECT_TRUE(there("alone-a/graph/report.json"));
  EXPECT_EQ(*series->takeUp(out_ + "/seed-2"), std::nullopt);
  EXPECT_FALSE(there("seed-2/report.json")) << "half of a run";
}

TEST_F(RunSeriesTest, RunsOfAnotherCommandAreNotMixedWithThese) {
  finishOne();
  json other = plan_;
  other["robots"] = {"a=two"};
  const auto refused = RunSeries::begin(out_, other, false);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kWrongUse);
  EXPECT_NE(refused.error().text.find("robots [\"a=one\"] there, [\"a=two\"] here"), std::string::npos)
      << refused.error().text;
  EXPECT_FALSE(prepareRunFolder(out_, false)) << "nor by a single run";
  EXPECT_TRUE(there("alone-a/graph/report.json"));
  auto anew = RunSeries::begin(out_, other, true);
  ASSERT_TRUE(anew) << anew.error().text;
  EXPECT_FALSE(there("alone-a"));
}

TEST_F(RunSeriesTest, AnotherCommandMayFollowOneThatCameToNothing) {
  { ASSERT_TRUE(RunSeries::begin(out_, plan_, false)); }
  json other = plan_;
  other["mode"] = "paper";
  EXPECT_TRUE(RunSeries::begin(out_, other, false));
}

TEST_F(RunSeriesTest, TwoProgramsDoNotWorkOnTheSameRuns) {
  const auto first = RunSeries::begin(out_, plan_, false);
  ASSERT_TRUE(first);
  for (const bool overwrite : {false, true}) {
    const auto second = RunSeries::begin(out_, plan_, overwrite);
    ASSERT_FALSE(second) << overwrite;
    EXPECT_EQ(second.error().code, ErrorCode::kUnreachable);
  }
}

TEST_F(RunSeriesTest, MarksThatSayNothingAreNotTrusted) {
  finishOne();
  std::ofstream(finishedMarkOf(out_ + "/alone-a/graph")) << "[]";
  {
    auto series = RunSeries::begin(out_, plan_, false);
    ASSERT_TRUE(series);
    const auto taken = series->takeUp(out_ + "/alone-a/graph");
    ASSERT_FALSE(taken);
    EXPECT_EQ(taken.error().code, ErrorCode::kBadData);
  }
  std::ofstream(seriesMarkOf(out_)) << "no JSON";
  EXPECT_EQ(RunSeries::begin(out_, plan_, false).error().code, ErrorCode::kBadData);
  EXPECT_TRUE(RunSeries::begin(out_, plan_, true));
}

}  // namespace
}  // namespace comap
