// A core that is killed and started again on its store: no keyframe that it acknowledged is lost, and mapping goes on.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <functional>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "tests/end_to_end/background.h"
#include "tests/end_to_end/flat_test.h"

namespace comap {
namespace {

using Json = nlohmann::json;

Json infoOf(const std::string& store) {
  const ProgramRun run = runProgram("fleet info --json " + store);
  return run.exit_code == 0 ? Json::parse(run.out) : Json();
}

size_t mapped(const Json& info) {
  if (info.is_null()) return 0;
  return info.at("keyframes").get<size_t>() - info.at("keyframes_without_pose").get<size_t>();
}

class Restart : public FlatTest {
 protected:
  // Each core has its own log: what an earlier one said must not be taken for a later one's words.
  std::unique_ptr<Background> core(const std::string& log) {
    return std::make_unique<Background>(
        "mapping_core", std::vector<std::string>{"--domain", "94", "--core-site", site_, "--store", store_},
        folder_.path(log));
  }
  std::unique_ptr<Background> agent(const std::string& robot) {
    return std::make_unique<Background>(
        "edge_agent",
        std::vector<std::string>{"--domain", "94", "--core-site", site_, "--robot", robot, "--source",
                                 "tum:" + flat_ + "/" + robot, "--report", folder_.path(robot + ".json"), "--patience",
                                 "120", "--outbox", folder_.path("outbox")},
        folder_.path(robot + ".log"));
  }
  // True once the store holds `keyframes` in its maps.
  bool awaitMapped(size_t keyframes, Background& core) {
    for (int i = 0; i < 1200 && core.runs(); ++i) {
      if (mapped(infoOf(store_)) >= keyframes) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    return false;
  }

  const std::string site_ = "restart-" + std::to_string(getpid());  // test runs may go on side by side
  const std::string store_ = folder_.path("map.comap");
};

TEST_F(Restart, AfterKillNineNothingAcknowledgedIsLostAndMappingGoesOn) {
  auto first = core("first.log");
  auto a = agent("a"), b = agent("b");
  ASSERT_TRUE(awaitMapped(5, *first)) << contentOf(folder_.path("first.log"));
  EXPECT_EQ(first->end(SIGKILL), 128 + SIGKILL);
  const Json before = infoOf(store_);
  ASSERT_FALSE(before.is_null());
  EXPECT_FALSE(before.at("complete").get<bool>());

  auto second = core("second.log");
  EXPECT_EQ(a->wait(), 0) << contentOf(folder_.path("a.log"));
  EXPECT_EQ(b->wait(), 0) << contentOf(folder_.path("b.log"));
  ASSERT_EQ(second->end(SIGTERM), 0) << contentOf(folder_.path("second.log"));
  EXPECT_NE(contentOf(folder_.path("second.log")).find("continues with"), std::string::npos);

  const Json after = infoOf(store_);
  ASSERT_FALSE(after.is_null());
  EXPECT_TRUE(after.at("complete").get<bool>());
  EXPECT_EQ(after.at("keyframes_without_pose"), 0);
  EXPECT_EQ(after.at("maps").size(), 1u) << after.dump(2);
  for (const Json& robot : after.at("robots")) {
    const Json report = Json::parse(contentOf(folder_.path(robot.at("name").get<std::string>() + ".json")));
    EXPECT_EQ(robot.at("keyframes"), report.at("keyframes")) << robot.at("name");
    EXPECT_EQ(robot.at("sessions"), 1);
    EXPECT_EQ(report.at("map"), after.at("maps")[0].at("id")) << "the correction of the new core counts";
  }

  // A third core has nothing to add: the same map, to the bit.
  const auto hashOf = [&] {
    const ProgramRun run = runProgram("fleet export " + store_ + " --format ply --out " + folder_.path("map.ply"));
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return std::hash<std::string>()(contentOf(folder_.path("map.ply")));
  };
  const size_t expected = hashOf();
  auto third = core("third.log");
  for (int i = 0; i < 600 && third->runs(); ++i) {
    const std::string log = contentOf(folder_.path("third.log"));
    if (log.find("0 more are still to be mapped") != std::string::npos) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
  ASSERT_EQ(third->end(SIGTERM), 0) << contentOf(folder_.path("third.log"));
  EXPECT_EQ(hashOf(), expected);
}

}  // namespace
}  // namespace comap
