#include "fleet_tools/evaluate/evaluate_table.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/files/temporary_folder.h"

namespace comap {
namespace {

// Joint ATE, precision and first merge; the other columns empty.
RunNumbers numbers(std::optional<double> joint, std::optional<double> precision, std::optional<double> first) {
  RunNumbers run;
  run[1] = joint;
  run[4] = precision;
  run[7] = first;
  return run;
}

TEST(EvaluateTable, medianAndWorstByHand) {
  const RunSummary three =
      summarise({numbers(0.03, 0.9, 5.0), numbers(0.01, 1.0, 7.0), numbers(0.02, 0.95, std::nullopt)});
  EXPECT_DOUBLE_EQ(*three.median[1], 0.02);
  EXPECT_DOUBLE_EQ(*three.worst[1], 0.03);
  EXPECT_DOUBLE_EQ(*three.median[4], 0.95);
  EXPECT_DOUBLE_EQ(*three.worst[4], 0.9) << "less is worse";
  EXPECT_DOUBLE_EQ(*three.median[7], 6.0) << "of two: their mean";
  EXPECT_FALSE(three.worst[7]) << "a run that never merged is the worst";
  EXPECT_FALSE(three.median[2]);
  EXPECT_FALSE(three.worst[2]);
}

TEST(EvaluateTable, oneLineARunAndTwoMore) {
  const std::string text = tableOf({"x/one", "x/two"}, {numbers(0.1234, 1, 2), numbers(0.2, 1, 3)});
  EXPECT_NE(text.find("x/one"), std::string::npos);
  EXPECT_NE(text.find("0.1234"), std::string::npos);
  EXPECT_NE(text.find("median"), std::string::npos);
  EXPECT_NE(text.find("0.1617"), std::string::npos) << text;
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 5);
}

TEST(EvaluateTable, aFolderOfSeedsStandsForItsRuns) {
  TemporaryFolder folder;
  EXPECT_EQ(runsIn(folder / "none").error().code, ErrorCode::kUnreachable);
  folder.write("many/seed-1/report.json", "{}");
  folder.write("many/seed-2/report.json", "{}");
  folder.write("one/report.json", "{}");
  EXPECT_EQ(*runsIn(folder / "many"), (std::vector<std::string>{folder / "many/seed-1", folder / "many/seed-2"}));
  EXPECT_EQ(*runsIn(folder / "one"), std::vector<std::string>{folder / "one"});
}

}  // namespace
}  // namespace comap
