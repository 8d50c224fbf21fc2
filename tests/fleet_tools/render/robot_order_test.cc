#include "fleet_tools/render/robot_order.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

using Names = std::vector<std::string>;

TEST(RobotOrder, IsThatOfTheNamesWhoeverArrivesFirst) {
  std::vector<Surfel> surfels(4);
  surfels[0].contributors = 0b001;  // of the first that arrived
  surfels[1].contributors = 0b010;
  surfels[2].contributors = 0b110;
  const Names arrived = {"kit", "zed", "alfa"};
  EXPECT_EQ(orderContributors(arrived, surfels), (Names{"alfa", "kit", "zed"})) << "a legend says what the bits say";
  EXPECT_EQ(surfels[0].contributors, 0b010u);
  EXPECT_EQ(surfels[1].contributors, 0b100u);
  EXPECT_EQ(surfels[2].contributors, 0b101u);
  EXPECT_EQ(surfels[3].contributors, 0u);
  EXPECT_EQ(placesByName(arrived), (std::vector<size_t>{1, 2, 0}));
}

TEST(RobotOrder, WhoHasNoPartInTheMapComesAfterThoseWhoHave) {
  EXPECT_EQ(orderByName(Names{"kit", "bob"}, Names{"zed", "kit", "alfa"}), (Names{"bob", "kit", "alfa", "zed"}));
}

}  // namespace
}  // namespace comap
