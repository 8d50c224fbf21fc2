#include "edge_agent/capture/heat_rule.h"

#include <gtest/gtest.h>

#include "tests/files/temporary_folder.h"

namespace comap {
namespace {

using std::chrono::seconds;

class HeatRuleTest : public testing::Test {
 protected:
  // The same temperature for so long, looked at each 2 s.
  void stay(std::optional<double> celsius, int for_s) {
    for (int s = 0; s < for_s; s += 2, now_ += seconds(2)) rule_.measured(celsius, now_);
  }

  HeatRule::Clock::time_point now_{seconds(1000)};
  HeatRule rule_{85};
};

TEST_F(HeatRuleTest, StepsDownWhileItIsHotAndNoFurtherThanOneOfEight) {
  stay(84.9, 100);
  EXPECT_EQ(rule_.every(), 1);
  stay(85, 2);
  EXPECT_EQ(rule_.every(), 2) << "at once";
  stay(85, 8);
  EXPECT_EQ(rule_.every(), 2) << "what was done needs time to be felt";
  stay(85, 2);
  EXPECT_EQ(rule_.every(), 3);
  stay(95, 600);
  EXPECT_EQ(rule_.every(), 8);
}

TEST_F(HeatRuleTest, GoesBackAStepAfterEachThirtySecondsInTheCool) {
  stay(90, 12);
  ASSERT_EQ(rule_.every(), 3);
  stay(82, 300);
  EXPECT_EQ(rule_.every(), 3) << "neither hot nor cool";
  stay(80, 30);
  EXPECT_EQ(rule_.every(), 3);
  stay(82, 2);
  stay(80, 30);
  EXPECT_EQ(rule_.every(), 3) << "not thirty seconds on end";
  stay(80, 2);
  EXPECT_EQ(rule_.every(), 2);
  stay(20, 300);
  EXPECT_EQ(rule_.every(), 1);
}

TEST_F(HeatRuleTest, WhatIsNotKnownChangesNothing) {
  stay(std::nullopt, 100);
  EXPECT_EQ(rule_.every(), 1);
  stay(90, 12);
  stay(std::nullopt, 300);
  EXPECT_EQ(rule_.every(), 3);
  HeatRule off(0);
  off.measured(150, now_);
  EXPECT_EQ(off.every(), 1);
}

TEST(Heat, IsThatOfTheHottestZoneThatCanBeRead) {
  const TemporaryFolder folder;
  EXPECT_FALSE(hottest_C(folder / "none"));
  EXPECT_FALSE(hottest_C(folder.path()));
  folder.write("cooling_device0/temp", "99000\n");
  EXPECT_FALSE(hottest_C(folder.path()));
  folder.write("thermal_zone0/temp", "41500\n");
  folder.write("thermal_zone1/temp", "67250\n");
  folder.write("thermal_zone2/temp", "no number\n");
  folder.write("thermal_zone3/temp", "-274000\n");
  folder.write("thermal_zone4/temp", "2147483647\n");
  folder.write("thermal_zone5/type", "silent\n");
  ASSERT_TRUE(hottest_C(folder.path()));
  EXPECT_EQ(*hottest_C(folder.path()), 67.25);
}

}  // namespace
}  // namespace comap
