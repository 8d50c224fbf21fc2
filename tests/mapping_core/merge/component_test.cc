#include "mapping_core/merge/component.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace comap {
namespace {

KeyframeId idOf(const std::string& robot, uint32_t sequence) { return {robot, 1, sequence}; }

ComponentSet threeChains() {
  ComponentSet set;
  for (const char* robot : {"bravo", "alpha", "carol"}) {
    set.addAlone(idOf(robot, 0));
    for (uint32_t i = 1; i < 4; ++i) set.addTo(idOf(robot, i), idOf(robot, i - 1));
  }
  return set;
}

TEST(ComponentSet, chainsAreTheirOwnMaps) {
  const ComponentSet set = threeChains();
  EXPECT_EQ(set.anchors(), (std::vector{idOf("alpha", 0), idOf("bravo", 0), idOf("carol", 0)}));
  EXPECT_EQ(set.anchorOf(idOf("bravo", 3)), idOf("bravo", 0));
  EXPECT_FALSE(set.together(idOf("alpha", 1), idOf("bravo", 1)));
  EXPECT_FALSE(set.contains(idOf("alpha", 9)));
  EXPECT_EQ(set.robots(idOf("carol", 0)), std::vector<std::string>{"carol"});
  EXPECT_TRUE(set.members(idOf("nobody", 0)).empty());
}

TEST(ComponentSet, theSmallestAnchorIsKeptWhicheverWayRound) {
  for (const bool swapped : {false, true}) {
    ComponentSet set = threeChains();
    const KeyframeId a = idOf("carol", 2), b = idOf("alpha", 1);
    const auto joined = swapped ? set.join(b, a) : set.join(a, b);
    ASSERT_TRUE(joined);
    EXPECT_EQ(joined->first, idOf("alpha", 0));
    EXPECT_EQ(joined->second, idOf("carol", 0));
    EXPECT_TRUE(set.together(idOf("carol", 3), idOf("alpha", 3)));
    EXPECT_FALSE(set.join(a, b)) << "they are one already";
    EXPECT_EQ(set.robots(idOf("alpha", 0)), (std::vector<std::string>{"alpha", "carol"}));
    EXPECT_EQ(set.members(idOf("carol", 0)).size(), 8u) << "an absorbed anchor still leads to its map";
  }
}

TEST(ComponentSet, keyframesThatFollowAMergeJoinTheJointMap) {
  ComponentSet set = threeChains();
  ASSERT_TRUE(set.join(idOf("alpha", 0), idOf("bravo", 0)));
  set.addTo(idOf("bravo", 4), idOf("bravo", 3));
  EXPECT_EQ(set.anchorOf(idOf("bravo", 4)), idOf("alpha", 0));
  const std::vector<KeyframeId> members = set.members(idOf("alpha", 0));
  EXPECT_EQ(members.front(), idOf("bravo", 0)) << "in order of addition, not of name";
  EXPECT_EQ(members.back(), idOf("bravo", 4));
}

TEST(ComponentSet, addingTwiceChangesNothing) {
  ComponentSet set = threeChains();
  set.addAlone(idOf("alpha", 2));
  set.addTo(idOf("alpha", 2), idOf("bravo", 0));
  EXPECT_EQ(set.anchors().size(), 3u);
  EXPECT_EQ(set.anchorOf(idOf("alpha", 2)), idOf("alpha", 0));
  EXPECT_EQ(set.members(idOf("alpha", 0)).size(), 4u);
}

TEST(ComponentSet, orderOfJoinsDoesNotMatter) {
  std::mt19937 engine(1);
  std::uniform_int_distribution<uint32_t> any(0, 59);
  std::vector<std::pair<uint32_t, uint32_t>> joins;
  for (int i = 0; i < 45; ++i) joins.emplace_back(any(engine), any(engine));
  std::vector<KeyframeId> expected;
  for (int round = 0; round < 20; ++round) {
    ComponentSet set;
    for (uint32_t i = 0; i < 60; ++i) set.addAlone(idOf("r", i));
    for (const auto& [a, b] : joins) set.join(idOf("r", a), idOf("r", b));
    std::vector<KeyframeId> anchors;
    for (uint32_t i = 0; i < 60; ++i) anchors.push_back(set.anchorOf(idOf("r", i)));
    for (uint32_t i = 0; i < 60; ++i) EXPECT_LE(anchors[i], idOf("r", i)) << "an anchor is its map's smallest";
    if (round == 0) expected = anchors;
    EXPECT_EQ(anchors, expected);
    std::shuffle(joins.begin(), joins.end(), engine);
  }
}

TEST(ComponentSet, mapNames) { EXPECT_EQ(mapIdOf({"alpha", 12, 3}), "alpha-12-3"); }

}  // namespace
}  // namespace comap
