// What only DDS can do wrong: processes, ports, pressure, repeated opening and closing.
#include "protocol/link/dds_link.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <thread>

extern char** environ;

namespace comap {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

int testDomain() { return 100 + getpid() % 121; }

std::unique_ptr<Link> connect(const std::string& site, LinkRole role, const std::string& robot = "") {
  auto link = connectDds({testDomain(), site, role, robot, "127.0.0.1"});
  if (!link) {
    ADD_FAILURE() << link.error().text;
    return nullptr;
  }
  return std::move(*link);
}

bool waitForPeers(Link& link, int count) {
  for (int i = 0; i < 4000 && link.peers() != count; ++i) std::this_thread::sleep_for(5ms);
  return link.peers() == count;
}

TEST(DdsLink, RefusesOptionsOutOfRange) {
  for (const int domain : {-1, 231, 100000}) {
    const auto link = connectDds({domain, "s", LinkRole::kCore, "", "127.0.0.1"});
    ASSERT_FALSE(link);
    EXPECT_EQ(link.error().code, ErrorCode::kWrongUse);
    EXPECT_THAT(link.error().text, HasSubstr("expected 0 to 230"));
  }
  EXPECT_FALSE(connectDds({testDomain(), "", LinkRole::kCore, "", "127.0.0.1"}));
  EXPECT_FALSE(connectDds({testDomain(), "site*", LinkRole::kCore, "", "127.0.0.1"}));
  EXPECT_FALSE(connectDds({testDomain(), "s", LinkRole::kRobot, "Not A Name", "127.0.0.1"}));
  for (const char* address : {"", "localhost", "127.0.0.2", "203.0.113.7", "1.2.3"}) {
    const auto link = connectDds({testDomain(), "s", LinkRole::kCore, "", address});
    ASSERT_FALSE(link) << address;
    EXPECT_EQ(link.error().code, ErrorCode::kUnreachable);
    EXPECT_THAT(link.error().text, HasSubstr("link.interface_address"));
  }
}

TEST(DdsLink, WorksBetweenProcesses) {
  auto core = connect("two-processes", LinkRole::kCore);
  ASSERT_TRUE(core);
  std::string program = DDS_TEST_ROBOT, domain = std::to_string(testDomain()), count = "40";
  char* arguments[] = {program.data(), domain.data(), count.data(), nullptr};
  pid_t child = 0;
  ASSERT_EQ(posix_spawn(&child, program.c_str(), nullptr, nullptr, arguments, environ), 0);
  int keyframes = 0, hellos = 0;
  while (keyframes < 40 || hellos < 1) {
    const auto got = core->receive(40s);
    if (!got) break;
    EXPECT_EQ(got->robot, "far");
    if (got->topic == Topic::kHello) ++hellos;
    if (got->topic != Topic::kKeyframe) continue;
    ASSERT_EQ(got->payload.size(), 300000u);
    EXPECT_EQ(got->payload.front(), keyframes);
    EXPECT_EQ(got->payload.back(), keyframes);
    ++keyframes;
  }
  EXPECT_EQ(keyframes, 40);
  EXPECT_EQ(hellos, 1);
  for (const Topic topic : {Topic::kAck, Topic::kCorrection, Topic::kTile}) {
    const std::vector<uint8_t> payload(topic == Topic::kTile ? 5000 : 900, 1);
    for (int i = 0; i < 1000 && !core->publish(topic, "far", payload); ++i) std::this_thread::sleep_for(5ms);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
  EXPECT_TRUE(waitForPeers(*core, 0));
}

TEST(DdsLink, SitesDoNotHearEachOther) {
  auto core = connect("north", LinkRole::kCore), far_core = connect("south", LinkRole::kCore);
  auto robot = connect("north", LinkRole::kRobot, "r1");
  ASSERT_TRUE(core && far_core && robot);
  ASSERT_TRUE(waitForPeers(*robot, 1));
  ASSERT_TRUE(robot->publish(Topic::kHello, "r1", {}));
  EXPECT_TRUE(core->receive(20s));
  EXPECT_FALSE(far_core->receive(500ms));
  EXPECT_EQ(far_core->peers(), 0);
}

TEST(DdsLink, ACoreThatTakesNothingStopsTheRobotInsteadOfGrowing) {
  auto core = connect("pressure", LinkRole::kCore);
  auto robot = connect("pressure", LinkRole::kRobot, "r1");
  ASSERT_TRUE(core && robot);
  ASSERT_TRUE(waitForPeers(*core, 1) && waitForPeers(*robot, 1));
  uint32_t sent = 0;
  Result<void> last;
  while (sent < 200) {
    std::vector<uint8_t> payload(100000, static_cast<uint8_t>(sent));
    last = robot->publish(Topic::kKeyframe, "r1", payload);
    if (!last) break;
    ++sent;
  }
  ASSERT_FALSE(last) << "200 keyframes were taken by nobody";
  EXPECT_EQ(last.error().code, ErrorCode::kUnreachable);
  EXPECT_THAT(last.error().text, HasSubstr("comap/v1/keyframe: 100000 bytes not taken within 10000 ms by 1 readers"));
  EXPECT_GE(sent, 16u);
  EXPECT_LE(sent, 48u);
  // Small talk still passes, and once the core reads again nothing of what was accepted is missing.
  EXPECT_TRUE(robot->publish(Topic::kStatus, "r1", {}));
  uint32_t got = 0;
  while (const auto delivery = core->receive(5s)) {
    if (delivery->topic != Topic::kKeyframe) continue;
    EXPECT_EQ(delivery->payload.front(), static_cast<uint8_t>(got));
    if (++got == sent) break;
  }
  EXPECT_EQ(got, sent);
  EXPECT_TRUE(robot->publish(Topic::kKeyframe, "r1", {}));
  EXPECT_TRUE(core->receive(10s));
}

TEST(DdsLink, ARobotThatTakesNothingDoesNotStopTheCore) {
  auto core = connect("sleeper", LinkRole::kCore);
  auto sleeper = connect("sleeper", LinkRole::kRobot, "s"), awake = connect("sleeper", LinkRole::kRobot, "a");
  ASSERT_TRUE(core && sleeper && awake);
  ASSERT_TRUE(waitForPeers(*core, 2) && waitForPeers(*awake, 1) && waitForPeers(*sleeper, 1));
  const std::vector<uint8_t> tile(2000, 1);
  const auto start = std::chrono::steady_clock::now();
  int taken = 0;
  for (int i = 0; i < 1000 && taken == 0; ++i) {  // until the writer has found its reader
    taken += core->publish(Topic::kTile, "s", tile) ? 1 : 0;
    std::this_thread::sleep_for(5ms);
  }
  for (int i = 0; i < 700; ++i) taken += core->publish(Topic::kTile, "s", tile) ? 1 : 0;
  EXPECT_LT(std::chrono::steady_clock::now() - start, 5s);
  EXPECT_GE(taken, 256);
  EXPECT_LE(taken, 512);  // 256 at either end
  for (int i = 0; i < 1000 && !core->publish(Topic::kTile, "a", tile); ++i) std::this_thread::sleep_for(5ms);
  EXPECT_TRUE(awake->receive(10s));
}

// A core makes what it needs to speak with a robot or an observer when it first has something to say to it.
TEST(DdsLink, NamesOfThoseWhoLeftDoNotUseUpTheLink) {
  auto core = connect("many", LinkRole::kCore);
  auto stays = connect("many", LinkRole::kRobot, "stays");
  ASSERT_TRUE(core && stays);
  ASSERT_TRUE(waitForPeers(*core, 1) && waitForPeers(*stays, 1));
  ASSERT_TRUE(core->publish(Topic::kAck, "stays", std::vector<uint8_t>{1}));
  ASSERT_TRUE(stays->receive(20s));
  for (int i = 0; i < 300; ++i) {
    const auto published = core->publish(Topic::kAck, "passer-" + std::to_string(i), {});
    ASSERT_TRUE(published) << i << ": " << published.error().text;
  }
  ASSERT_TRUE(core->publish(Topic::kAck, "stays", std::vector<uint8_t>{2}));
  auto delivery = stays->receive(20s);
  ASSERT_TRUE(delivery);
  EXPECT_EQ(delivery->payload, std::vector<uint8_t>{2}) << "its writers were not dropped";
  auto back = connect("many", LinkRole::kRobot, "passer-0");
  ASSERT_TRUE(back && waitForPeers(*back, 1));
  delivery.reset();
  for (int i = 0; i < 100 && !delivery; ++i) {
    ASSERT_TRUE(core->publish(Topic::kAck, "passer-0", std::vector<uint8_t>{3}));
    delivery = back->receive(200ms);
  }
  ASSERT_TRUE(delivery);
  EXPECT_EQ(delivery->payload, std::vector<uint8_t>{3});
}

size_t openFiles() {
  size_t count = 0;
  for (int fd = 0; fd < 4096; ++fd) count += fcntl(fd, F_GETFD) != -1 ? 1 : 0;
  return count;
}

TEST(DdsLink, OpensAndClosesAgainAndAgain) {
  { ASSERT_TRUE(connect("again", LinkRole::kCore)); }  // whatever the library sets up once
  const size_t files = openFiles();
  for (int round = 0; round < 8; ++round) {
    const auto start = std::chrono::steady_clock::now();
    {
      auto core = connect("again", LinkRole::kCore);
      auto robot = connect("again", LinkRole::kRobot, "r1");
      ASSERT_TRUE(core && robot);
      ASSERT_TRUE(robot->publish(Topic::kHello, "r1", {}));
      ASSERT_TRUE(core->receive(20s)) << round;
      // Closed with messages on their way and unread.
      for (int i = 0; i < 5; ++i) ASSERT_TRUE(robot->publish(Topic::kKeyframe, "r1", std::vector<uint8_t>(200000)));
    }
    EXPECT_LT(std::chrono::steady_clock::now() - start, 15s);
  }
  EXPECT_LE(openFiles(), files);
}

}  // namespace
}  // namespace comap
