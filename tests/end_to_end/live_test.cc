// A running site as an observer hears it: `fleet watch`, and the tiles that `fleet view --live` asks for.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "fleet_tools/view/live_scene.h"
#include "fleet_tools/watch/observer_link.h"
#include "tests/end_to_end/background.h"
#include "tests/end_to_end/flat_test.h"

namespace comap {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

constexpr const char* kDomain = "187";

class Live : public FlatTest {};

TEST_F(Live, ASiteIsWatchedAndItsTilesComeToAnObserver) {
  const ProgramRun nobody = runProgram("fleet watch --wait 1 --domain " + std::string(kDomain));
  EXPECT_EQ(nobody.exit_code, 3);
  EXPECT_THAT(nobody.err, HasSubstr("no mapping core of site 'default' on DDS domain 187 was heard for 1 s"));

  Background core("mapping_core", {"--store", folder_.path("live.comap"), "--domain", kDomain},
                  folder_.path("core.log"));
  Background robot("edge_agent",
                   {"--robot", "a", "--source", "tum:" + flat_ + "/a@0:40", "--domain", kDomain, "--outbox", "memory"},
                   folder_.path("a.log"));
  DdsLinkOptions options;
  options.domain = std::stoi(kDomain);
  options.role = LinkRole::kObserver;
  std::string name;
  auto link = connectObserver(options, true, name);
  ASSERT_TRUE(link) << link.error().text;
  LiveScene scene(std::move(*link), name, "default");
  ViewFeed feed;
  const auto until = std::chrono::steady_clock::now() + 90s;
  while (feed.tiles() < 20 && std::chrono::steady_clock::now() < until) {
    scene.hear(feed, 50ms);
    std::this_thread::sleep_for(50ms);
  }
  EXPECT_GE(feed.tiles(), 20u) << contentOf(folder_.path("core.log")) << contentOf(folder_.path("a.log"));
  EXPECT_EQ(robot.wait(), 0) << contentOf(folder_.path("a.log")) << "nobody who watches holds a robot up";

  const ProgramRun watched = runProgram("fleet watch --json --for 3 --domain " + std::string(kDomain));
  EXPECT_EQ(watched.exit_code, 0) << watched.err;
  std::istringstream lines(watched.out);
  nlohmann::json last;
  for (std::string line; std::getline(lines, line);) last = nlohmann::json::parse(line);
  ASSERT_TRUE(last.is_object()) << watched.out;
  EXPECT_EQ(last.at("core_heard"), true);
  EXPECT_GT(last.at("core").at("keyframes").get<int>(), 0);
  EXPECT_TRUE(last.at("robots").contains("a"));
  EXPECT_EQ(core.end(SIGTERM), 0) << contentOf(folder_.path("core.log"));
}

}  // namespace
}  // namespace comap
