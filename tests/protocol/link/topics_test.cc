#include "protocol/link/topics.h"

#include <gtest/gtest.h>

#include <set>

namespace comap {
namespace {

TEST(Topics, HaveDistinctNames) {
  std::set<std::string> names;
  for (const Topic topic : kAllTopics) {
    EXPECT_TRUE(topicName(topic).starts_with("comap/v1/"));
    names.insert(topicName(topic));
  }
  EXPECT_EQ(names.size(), kAllTopics.size());
}

TEST(Topics, EachHasOneWriterAndAReader) {
  for (const Topic topic : kAllTopics) {
    EXPECT_NE(writes(LinkRole::kRobot, topic), writes(LinkRole::kCore, topic)) << topicName(topic);
    EXPECT_EQ(writes(LinkRole::kObserver, topic), topic == Topic::kInterest) << topicName(topic);
    EXPECT_TRUE(reads(LinkRole::kRobot, topic) || reads(LinkRole::kCore, topic) || reads(LinkRole::kObserver, topic));
    for (const LinkRole role : {LinkRole::kRobot, LinkRole::kCore}) {
      EXPECT_FALSE(writes(role, topic) && reads(role, topic)) << topicName(topic);
    }
  }
}

TEST(Topics, PublishIsCheckedForRoleAndName) {
  EXPECT_TRUE(checkPublish(LinkRole::kRobot, "r1", Topic::kKeyframe, "r1", 300000));
  EXPECT_FALSE(checkPublish(LinkRole::kRobot, "r1", Topic::kKeyframe, "r2", 1));
  EXPECT_FALSE(checkPublish(LinkRole::kRobot, "r1", Topic::kTile, "r1", 1));
  EXPECT_TRUE(checkPublish(LinkRole::kCore, "", Topic::kTile, "r1", 1));
  EXPECT_FALSE(checkPublish(LinkRole::kCore, "", Topic::kTile, "No Name", 1));
  EXPECT_FALSE(checkPublish(LinkRole::kCore, "", Topic::kAck, "", 1)) << "for no robot";
  EXPECT_TRUE(checkPublish(LinkRole::kCore, "", Topic::kVerdict, "", 1));
  EXPECT_FALSE(checkPublish(LinkRole::kObserver, "", Topic::kVerdict, "", 1));
  EXPECT_FALSE(checkPublish(LinkRole::kObserver, "", Topic::kInterest, "", 1)) << "it has no name";
  EXPECT_FALSE(checkPublish(LinkRole::kObserver, "desk", Topic::kInterest, "r1", 1)) << "in a robot's name";
  EXPECT_FALSE(checkPublish(LinkRole::kObserver, "desk", Topic::kStatus, "desk", 1));
  EXPECT_TRUE(checkPublish(LinkRole::kObserver, "desk", Topic::kInterest, "desk", 1));
  const auto huge = checkPublish(LinkRole::kRobot, "r1", Topic::kKeyframe, "r1", size_t{17} << 20);
  ASSERT_FALSE(huge);
  EXPECT_NE(huge.error().text.find("comap/v1/keyframe: 17825792 bytes"), std::string::npos);
}

TEST(Topics, WhatIsReplacedFitsOneDatagram) {
  for (const Topic topic : kAllTopics) {
    EXPECT_TRUE(!isReplaced(topic) || maxPayloadBytes(topic) <= 950u) << topicName(topic);
  }
  EXPECT_TRUE(checkPublish(LinkRole::kCore, "", Topic::kAck, "r1", 950));
  EXPECT_FALSE(checkPublish(LinkRole::kCore, "", Topic::kAck, "r1", 951));
}

TEST(Topics, ARobotSharesItsPartitionWithTheCoreAlone) {
  EXPECT_EQ(partitionWritten("s", "a"), "s/a");
  EXPECT_EQ(partitionWritten("s", ""), "s");
  EXPECT_EQ(partitionsRead(LinkRole::kRobot, "s", "a"), std::vector<std::string>{"s/a"});
  EXPECT_EQ(partitionsRead(LinkRole::kCore, "s", ""), std::vector<std::string>{"s/*"});
  EXPECT_EQ(partitionsRead(LinkRole::kObserver, "s", ""), (std::vector<std::string>{"s", "s/*"}));
}

}  // namespace
}  // namespace comap
