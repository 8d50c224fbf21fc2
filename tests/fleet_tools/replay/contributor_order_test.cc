#include "fleet_tools/replay/contributor_order.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

TEST(ContributorOrder, IsThatOfTheCommandWhoeverArrivesFirst) {
  const std::vector<ReplayRobot> robots = {{"zed", ""}, {"alfa", ""}, {"kit", ""}};
  std::vector<Surfel> surfels(4);
  surfels[0].contributors = 0b001;  // of the first that arrived
  surfels[1].contributors = 0b010;
  surfels[2].contributors = 0b110;
  const auto names = orderContributors(robots, {"kit", "zed", "alfa"}, surfels);
  EXPECT_EQ(names, (std::vector<std::string>{"zed", "alfa", "kit"})) << "a legend says what the bits say";
  EXPECT_EQ(surfels[0].contributors, 0b100u);
  EXPECT_EQ(surfels[1].contributors, 0b001u);
  EXPECT_EQ(surfels[2].contributors, 0b011u);
  EXPECT_EQ(surfels[3].contributors, 0u);
  EXPECT_EQ(orderOf(robots, "kit"), 2u);
  EXPECT_EQ(orderOf(robots, "nobody"), 3u);
}

}  // namespace
}  // namespace comap
