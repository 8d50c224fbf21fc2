#include "protocol/types/ids.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

TEST(KeyframeId, ordersByRobotThenSessionThenSequence) {
  EXPECT_LT((KeyframeId{"a", 9, 9}), (KeyframeId{"b", 1, 1}));
  EXPECT_LT((KeyframeId{"a", 1, 9}), (KeyframeId{"a", 2, 1}));
  EXPECT_LT((KeyframeId{"a", 1, 2}), (KeyframeId{"a", 1, 10}));
  EXPECT_EQ(toString({"scout-1", 18446744073709551615ull, 4294967295u}), "scout-1/18446744073709551615/4294967295");
}

TEST(RobotName, plainNamesPass) {
  for (const char* name : {"a", "robot_1", "0", "north-wing", "abcdefghijklmnopqrstuvwxyz012345"})
    EXPECT_EQ(robotNameProblem(name), "") << name;
}

TEST(RobotName, whatCouldEscapeAPathOrATopicIsRefused) {
  for (const char* name :
       {"", "A", "a b", "../etc", "a/b", "a.b", "\xc3\xa4", "a\n", "abcdefghijklmnopqrstuvwxyz0123456"})
    EXPECT_NE(robotNameProblem(name), "") << name;
  EXPECT_NE(robotNameProblem(std::string("a\0b", 3)), "");
  EXPECT_NE(robotNameProblem("Ann").find("Ann"), std::string::npos) << "the refusal names the value";
}

}  // namespace
}  // namespace comap
