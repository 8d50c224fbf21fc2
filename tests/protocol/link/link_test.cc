// What every link promises, asked of each.
#include "protocol/link/link.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <functional>
#include <map>
#include <thread>

#include "protocol/link/dds_link.h"
#include "protocol/link/loopback_link.h"
#include "tests/protocol/link/site_keys.h"

namespace comap {
namespace {

using namespace std::chrono_literals;

using Connect = std::function<std::unique_ptr<Link>(LinkRole, const std::string&)>;

// Tests that run side by side do not meet: another process, another domain; another test in it, another site.
Connect ddsConnect() {
  static int count = 0;
  const std::string site = "test-" + std::to_string(++count);
  return [site](LinkRole role, const std::string& robot) -> std::unique_ptr<Link> {
    auto link = connectDds({100 + getpid() % 121, site, role, robot, "127.0.0.1"});
    if (!link) {
      ADD_FAILURE() << link.error().text;
      return nullptr;
    }
    return std::move(*link);
  };
}

// The same with keys: nothing else may change.
Connect keyedDdsConnect() {
  static int count = 0;
  const std::string site = "keyed-" + std::to_string(++count);
  return [site, keys = std::make_shared<SiteKeys>(site)](LinkRole role, const std::string& robot) {
    DdsLinkOptions options{100 + getpid() % 121, site, role, robot, "127.0.0.1"};
    options.keys = role == LinkRole::kRobot  ? keys->of(KeyRole::kRobot, robot)
                   : role == LinkRole::kCore ? keys->of(KeyRole::kCore, "core")
                                             : keys->of(KeyRole::kTool, "tool");
    auto link = connectDds(options);
    if (!link) ADD_FAILURE() << link.error().text;
    return link ? std::move(*link) : nullptr;
  };
}

Connect loopbackConnect() {
  auto hub = std::make_shared<LoopbackHub>();
  return [hub](LinkRole role, const std::string& robot) { return hub->connect(role, robot); };
}

bool waitFor(const std::function<bool()>& condition, std::chrono::seconds limit = 20s) {
  const auto deadline = std::chrono::steady_clock::now() + limit;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(5ms);
  }
  return true;
}

std::vector<uint8_t> pattern(size_t size, uint32_t seed) {
  std::vector<uint8_t> bytes(size);
  for (size_t i = 0; i < size; ++i) bytes[i] = static_cast<uint8_t>((i * 2654435761u + seed * 40503u) >> 13);
  return bytes;
}

struct Wire {
  const char* name;
  Connect (*make)();
};

class EveryLink : public testing::TestWithParam<Wire> {
 protected:
  Connect connect_ = GetParam().make();
};

TEST_P(EveryLink, CarriesKeyframesUpAndAnswersDown) {
  auto core = connect_(LinkRole::kCore, "");
  auto robot = connect_(LinkRole::kRobot, "r1");
  ASSERT_TRUE(core && robot);
  ASSERT_TRUE(waitFor([&] { return core->peers() == 1 && robot->peers() == 1; }));
  for (uint32_t i = 0; i < 20; ++i) {
    const auto sent = robot->publish(Topic::kKeyframe, "r1", pattern(300000, i));
    ASSERT_TRUE(sent) << sent.error().text;
    const auto got = core->receive(10s);
    ASSERT_TRUE(got) << i;
    EXPECT_EQ(got->topic, Topic::kKeyframe);
    EXPECT_EQ(got->robot, "r1");
    EXPECT_TRUE(got->payload == pattern(300000, i)) << i;
  }
  for (const Topic topic : {Topic::kAck, Topic::kCorrection, Topic::kTile}) {
    const auto payload = pattern(topic == Topic::kTile ? 9000 : 900, 7);
    ASSERT_TRUE(waitFor([&] { return bool(core->publish(topic, "r1", payload)); }));
    const auto got = robot->receive(10s);
    ASSERT_TRUE(got) << static_cast<int>(topic);
    EXPECT_EQ(got->topic, topic);
    EXPECT_EQ(got->robot, "r1");
    EXPECT_TRUE(got->payload == payload);
  }
  for (const Topic topic : {Topic::kHello, Topic::kInterest, Topic::kStatus}) {
    ASSERT_TRUE(robot->publish(topic, "r1", {}));
    const auto got = core->receive(10s);
    ASSERT_TRUE(got);
    EXPECT_EQ(got->topic, topic);
    EXPECT_TRUE(got->payload.empty());
  }
}

TEST_P(EveryLink, LosesNoKeyframeOfABurstAndKeepsTheirOrder) {
  auto core = connect_(LinkRole::kCore, "");
  auto a = connect_(LinkRole::kRobot, "a"), b = connect_(LinkRole::kRobot, "b");
  ASSERT_TRUE(core && a && b);
  ASSERT_TRUE(waitFor([&] { return core->peers() == 2 && a->peers() == 1 && b->peers() == 1; }));
  constexpr uint32_t kCount = 60;
  const auto flood = [](Link& link, const std::string& name) {
    for (uint32_t i = 0; i < kCount; ++i) {
      const auto sent = link.publish(Topic::kKeyframe, name, pattern(100000, i));
      ASSERT_TRUE(sent) << sent.error().text;
    }
  };
  std::thread thread_a([&] { flood(*a, "a"); }), thread_b([&] { flood(*b, "b"); });
  std::map<std::string, uint32_t> next;
  for (uint32_t i = 0; i < 2 * kCount; ++i) {
    const auto got = core->receive(20s);
    if (!got) break;
    EXPECT_TRUE(got->payload == pattern(100000, next[got->robot])) << got->robot << " " << next[got->robot];
    ++next[got->robot];
  }
  thread_a.join();
  thread_b.join();
  EXPECT_EQ(next["a"], kCount);
  EXPECT_EQ(next["b"], kCount);
}

TEST_P(EveryLink, ALateCoreGetsTheLastHelloOfEachRobot) {
  auto a = connect_(LinkRole::kRobot, "a"), b = connect_(LinkRole::kRobot, "b");
  ASSERT_TRUE(a && b);
  ASSERT_TRUE(a->publish(Topic::kHello, "a", pattern(10, 1)));
  ASSERT_TRUE(a->publish(Topic::kHello, "a", pattern(10, 2)));
  ASSERT_TRUE(b->publish(Topic::kHello, "b", pattern(10, 3)));
  ASSERT_TRUE(a->publish(Topic::kStatus, "a", pattern(10, 4)));  // not latched
  auto core = connect_(LinkRole::kCore, "");
  ASSERT_TRUE(core);
  std::map<std::string, std::vector<uint8_t>> hellos;
  for (int i = 0; i < 2; ++i) {
    const auto got = core->receive(20s);
    ASSERT_TRUE(got);
    EXPECT_EQ(got->topic, Topic::kHello);
    hellos[got->robot] = got->payload;
  }
  EXPECT_EQ(hellos["a"], pattern(10, 2));
  EXPECT_EQ(hellos["b"], pattern(10, 3));
  EXPECT_FALSE(core->receive(300ms));
}

TEST_P(EveryLink, ALateRobotGetsItsLastAckAndCorrection) {
  auto core = connect_(LinkRole::kCore, "");
  ASSERT_TRUE(core);
  for (uint32_t i = 0; i < 5; ++i) {
    ASSERT_TRUE(core->publish(Topic::kAck, "a", pattern(20, i)));
    ASSERT_TRUE(core->publish(Topic::kAck, "b", pattern(20, 90 + i)));
    ASSERT_TRUE(core->publish(Topic::kCorrection, "a", pattern(30, i)));
  }
  auto robot = connect_(LinkRole::kRobot, "a");
  ASSERT_TRUE(robot);
  std::map<Topic, std::vector<uint8_t>> got;
  for (int i = 0; i < 2; ++i) {
    const auto delivery = robot->receive(20s);
    ASSERT_TRUE(delivery);
    EXPECT_EQ(delivery->robot, "a");
    got[delivery->topic] = delivery->payload;
  }
  EXPECT_EQ(got[Topic::kAck], pattern(20, 4));
  EXPECT_EQ(got[Topic::kCorrection], pattern(30, 4));
  EXPECT_FALSE(robot->receive(300ms));
}

TEST_P(EveryLink, ARobotHearsOnlyWhatIsForIt) {
  auto core = connect_(LinkRole::kCore, "");
  auto a = connect_(LinkRole::kRobot, "a"), b = connect_(LinkRole::kRobot, "b");
  ASSERT_TRUE(core && a && b);
  ASSERT_TRUE(waitFor([&] { return core->peers() == 2 && a->peers() == 1 && b->peers() == 1; }));
  for (uint32_t i = 0; i < 50; ++i) {
    ASSERT_TRUE(waitFor([&] { return bool(core->publish(Topic::kTile, "b", pattern(1000, i))); }));
    ASSERT_TRUE(core->publish(Topic::kAck, "b", pattern(10, i)));
  }
  ASSERT_TRUE(waitFor([&] { return bool(core->publish(Topic::kTile, "a", pattern(10, 71))); }));
  const auto got = a->receive(20s);
  ASSERT_TRUE(got);
  EXPECT_EQ(got->payload, pattern(10, 71));
  EXPECT_FALSE(a->receive(300ms));
  int tiles = 0;
  while (const auto other = b->receive(1s)) tiles += other->topic == Topic::kTile ? 1 : 0;
  EXPECT_EQ(tiles, 50);
}

TEST_P(EveryLink, AnObserverSeesWhatIsForAllAndNoImages) {
  auto observer = connect_(LinkRole::kObserver, "");
  auto core = connect_(LinkRole::kCore, "");
  auto robot = connect_(LinkRole::kRobot, "r1");
  ASSERT_TRUE(observer && core && robot);
  ASSERT_TRUE(waitFor([&] { return observer->peers() == 1 && core->peers() == 1 && robot->peers() == 1; }));
  ASSERT_TRUE(robot->publish(Topic::kKeyframe, "r1", pattern(1000, 1)));
  ASSERT_TRUE(robot->publish(Topic::kHello, "r1", pattern(10, 1)));
  ASSERT_TRUE(waitFor([&] { return bool(core->publish(Topic::kTile, "r1", pattern(1000, 1))); }));
  ASSERT_TRUE(core->publish(Topic::kCorrection, "r1", pattern(10, 2)));
  ASSERT_TRUE(core->publish(Topic::kVerdict, "", pattern(10, 3)));
  ASSERT_TRUE(core->publish(Topic::kMerge, "", pattern(10, 4)));
  ASSERT_TRUE(core->publish(Topic::kCoreStatus, "", pattern(10, 5)));
  std::map<Topic, int> seen;
  while (seen.size() < 5) {
    const auto got = observer->receive(20s);
    ASSERT_TRUE(got);
    ++seen[got->topic];
  }
  for (const Topic topic : {Topic::kHello, Topic::kCorrection, Topic::kVerdict, Topic::kMerge, Topic::kCoreStatus}) {
    EXPECT_EQ(seen[topic], 1);
  }
  EXPECT_FALSE(observer->publish(Topic::kVerdict, "", {}));
  EXPECT_FALSE(observer->receive(200ms));
}

TEST_P(EveryLink, AnObserverWithANameAsksForTilesAndGetsItsOwnAlone) {
  auto observer = connect_(LinkRole::kObserver, "tool");
  auto core = connect_(LinkRole::kCore, "");
  auto robot = connect_(LinkRole::kRobot, "r1");
  ASSERT_TRUE(observer && core && robot);
  ASSERT_TRUE(waitFor([&] { return observer->peers() == 1 && core->peers() == 1 && robot->peers() == 1; }));
  std::optional<Delivery> asked;
  ASSERT_TRUE(waitFor([&] {
    EXPECT_TRUE(observer->publish(Topic::kInterest, "tool", pattern(100, 1)));
    asked = core->receive(200ms);
    return asked.has_value();
  }));
  EXPECT_EQ(asked->topic, Topic::kInterest);
  EXPECT_EQ(asked->robot, "tool");
  EXPECT_FALSE(observer->publish(Topic::kInterest, "r1", pattern(100, 1)));
  ASSERT_TRUE(waitFor([&] { return bool(core->publish(Topic::kTile, "r1", pattern(1000, 2))); }));
  ASSERT_TRUE(waitFor([&] { return bool(core->publish(Topic::kTile, "tool", pattern(1000, 3))); }));
  const auto got = observer->receive(20s);
  ASSERT_TRUE(got);
  EXPECT_EQ(got->topic, Topic::kTile);
  EXPECT_EQ(got->payload, pattern(1000, 3));
  EXPECT_FALSE(observer->receive(300ms));
  const auto own = robot->receive(20s);
  ASSERT_TRUE(own);
  EXPECT_EQ(own->payload, pattern(1000, 2));
  EXPECT_FALSE(robot->receive(300ms));
}

TEST_P(EveryLink, ALateObserverGetsTheLastMergesInOrder) {
  auto core = connect_(LinkRole::kCore, "");
  ASSERT_TRUE(core);
  for (uint32_t i = 0; i < 300; ++i) ASSERT_TRUE(core->publish(Topic::kMerge, "", pattern(10, i)));
  auto observer = connect_(LinkRole::kObserver, "");
  ASSERT_TRUE(observer);
  for (uint32_t i = 300 - 256; i < 300; ++i) {
    const auto got = observer->receive(20s);
    ASSERT_TRUE(got) << i;
    EXPECT_EQ(got->payload, pattern(10, i)) << i;
  }
  EXPECT_FALSE(observer->receive(200ms));
}

TEST_P(EveryLink, ReceiveWaitsAsLongAsAskedAndNoLonger) {
  auto core = connect_(LinkRole::kCore, "");
  ASSERT_TRUE(core);
  const auto start = std::chrono::steady_clock::now();
  EXPECT_FALSE(core->receive(0ms));
  EXPECT_LT(std::chrono::steady_clock::now() - start, 100ms);
  EXPECT_FALSE(core->receive(200ms));
  EXPECT_GE(std::chrono::steady_clock::now() - start, 200ms);
  EXPECT_LT(std::chrono::steady_clock::now() - start, 2s);
}

TEST_P(EveryLink, ReceiveWakesForAMessage) {
  auto core = connect_(LinkRole::kCore, "");
  auto robot = connect_(LinkRole::kRobot, "r1");
  ASSERT_TRUE(core && robot);
  ASSERT_TRUE(waitFor([&] { return core->peers() == 1 && robot->peers() == 1; }));
  std::thread late([&] {
    std::this_thread::sleep_for(200ms);
    EXPECT_TRUE(robot->publish(Topic::kStatus, "r1", pattern(10, 1)));
  });
  const auto start = std::chrono::steady_clock::now();
  EXPECT_TRUE(core->receive(20s));
  EXPECT_LT(std::chrono::steady_clock::now() - start, 5s);
  late.join();
}

TEST_P(EveryLink, PeersComeAndGo) {
  auto core = connect_(LinkRole::kCore, "");
  ASSERT_TRUE(core);
  EXPECT_EQ(core->peers(), 0);
  for (int round = 0; round < 3; ++round) {
    auto robot = connect_(LinkRole::kRobot, "r1");
    ASSERT_TRUE(robot);
    EXPECT_TRUE(waitFor([&] { return core->peers() == 1; })) << round;
    robot.reset();
    EXPECT_TRUE(waitFor([&] { return core->peers() == 0; })) << round;
  }
}

INSTANTIATE_TEST_SUITE_P(Wires, EveryLink,
                         testing::Values(Wire{"Loopback", loopbackConnect}, Wire{"Dds", ddsConnect},
                                         Wire{"KeyedDds", keyedDdsConnect}),
                         [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace comap
