#include "protocol/link/loopback_link.h"

#include <gmock/gmock.h>

namespace comap {
namespace {

using namespace std::chrono_literals;

TEST(LoopbackLink, KeepsOneOrderAcrossTopicsAndRobots) {
  LoopbackHub hub;
  auto core = hub.connect(LinkRole::kCore);
  auto a = hub.connect(LinkRole::kRobot, "a"), b = hub.connect(LinkRole::kRobot, "b");
  std::vector<std::pair<std::string, Topic>> sent;
  for (int i = 0; i < 100; ++i) {
    const std::string name = i % 3 == 0 ? "a" : "b";
    const Topic topic = i % 5 == 0 ? Topic::kStatus : i % 7 == 0 ? Topic::kHello : Topic::kKeyframe;
    ASSERT_TRUE((name == "a" ? a : b)->publish(topic, name, {}));
    sent.emplace_back(name, topic);
  }
  for (const auto& [name, topic] : sent) {
    const auto got = core->receive(0ms);
    ASSERT_TRUE(got);
    EXPECT_EQ(got->robot, name);
    EXPECT_EQ(got->topic, topic);
  }
  EXPECT_FALSE(core->receive(0ms));
}

TEST(LoopbackLink, WhatAWriterLatchedGoesWithIt) {
  LoopbackHub hub;
  auto robot = hub.connect(LinkRole::kRobot, "a");
  ASSERT_TRUE(robot->publish(Topic::kHello, "a", {}));
  EXPECT_TRUE(hub.connect(LinkRole::kCore)->receive(0ms));
  robot.reset();
  EXPECT_FALSE(hub.connect(LinkRole::kCore)->receive(0ms));
}

TEST(LoopbackLink, AReaderThatNeverReadsDoesNotTakeAllMemory) {
  LoopbackHub hub;
  auto core = hub.connect(LinkRole::kCore);
  auto robot = hub.connect(LinkRole::kRobot, "a");
  const std::vector<uint8_t> large(size_t{16} << 20);
  for (int i = 0; i < 64; ++i) ASSERT_TRUE(robot->publish(Topic::kKeyframe, "a", large)) << i;
  const auto refused = robot->publish(Topic::kKeyframe, "a", large);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kUnreachable);
  EXPECT_THAT(refused.error().text, testing::HasSubstr("has let 1073741824 bytes wait"));
  ASSERT_TRUE(core->receive(0ms));
  EXPECT_TRUE(robot->publish(Topic::kKeyframe, "a", large));
}

TEST(LoopbackLink, LinksOutliveTheirHub) {
  std::unique_ptr<Link> core, robot;
  {
    LoopbackHub hub;
    core = hub.connect(LinkRole::kCore);
    robot = hub.connect(LinkRole::kRobot, "a");
  }
  ASSERT_TRUE(robot->publish(Topic::kKeyframe, "a", {}));
  EXPECT_TRUE(core->receive(0ms));
}

}  // namespace
}  // namespace comap
