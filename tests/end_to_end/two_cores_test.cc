// Two cores where one should be: of a site, or of a store.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/end_to_end/background.h"
#include "tests/end_to_end/flat_test.h"

namespace comap {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class TwoCores : public FlatTest {};

TEST_F(TwoCores, OfOneSiteTheSecondGivesWay) {
  const std::string site = " --domain 98 --core-site twice --store " + folder_.path();
  const std::string first = "timeout 20 " COMAP_BIN_DIR "/mapping_core" + site + "/first.comap >/dev/null 2>&1 &";
  ASSERT_EQ(std::system(first.c_str()), 0);
  // The first needs a moment to be there; until then there is nothing to refuse.
  for (int i = 0; i < 50 && !fs::exists(folder_.path("first.comap")); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  std::this_thread::sleep_for(std::chrono::seconds(2));
  const ProgramRun second = runProgram("mapping_core" + site + "/second.comap", "timeout 10");
  EXPECT_EQ(second.exit_code, 3);
  EXPECT_THAT(second.err, HasSubstr("twice"));
  EXPECT_FALSE(fs::exists(folder_.path("second.comap")));
}

// They are there before either has been heard: one gives way, and the robot's keyframes are all with the other.
TEST_F(TwoCores, OfOneSiteStartedAtOnce) {
  const std::string site = "at-once-" + std::to_string(getpid());
  const auto core = [&](const std::string& name) {
    return std::make_unique<Background>(
        "mapping_core",
        std::vector<std::string>{"--domain", "95", "--core-site", site, "--store", folder_.path(name + ".comap")},
        folder_.path(name + ".log"));
  };
  std::map<std::string, std::unique_ptr<Background>> cores;
  cores["one"] = core("one");
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  cores["two"] = core("two");
  const ProgramRun robot =
      runProgram("edge_agent --robot a --domain 95 --core-site " + site + " --source tum:" + flat_ +
                 "/a@0:30 --outbox " + folder_.path() + " --report " + folder_.path("a.json"));
  EXPECT_EQ(robot.exit_code, 0) << robot.err;
  for (int i = 0; i < 600 && cores["one"]->runs() && cores["two"]->runs(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  const std::string stays = cores["one"]->runs() ? "one" : "two", goes = stays == "one" ? "two" : "one";
  EXPECT_EQ(cores[goes]->wait(), 3);
  EXPECT_THAT(contentOf(folder_.path(goes + ".log")), HasSubstr("is served by another mapping core"));
  EXPECT_EQ(cores[stays]->end(SIGTERM), 0) << contentOf(folder_.path(stays + ".log"));
  const ProgramRun info = runProgram("fleet info --json " + folder_.path(stays + ".comap"));
  ASSERT_EQ(info.exit_code, 0) << info.err;
  const auto report = nlohmann::json::parse(contentOf(folder_.path("a.json")));
  EXPECT_EQ(nlohmann::json::parse(info.out).at("keyframes"), report.at("keyframes"));
  EXPECT_GT(report.at("keyframes").get<int>(), 0);
}

TEST_F(TwoCores, OnOneStore) {
  const std::string store = " --store " + folder_.path("one.comap");
  ASSERT_EQ(
      std::system(("timeout 20 " COMAP_BIN_DIR "/mapping_core --domain 96" + store + " >/dev/null 2>&1 &").c_str()), 0);
  for (int i = 0; i < 50 && !fs::exists(folder_.path("one.comap")); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  std::this_thread::sleep_for(std::chrono::seconds(2));
  const ProgramRun second = runProgram("mapping_core --domain 97" + store, "timeout 10");
  EXPECT_EQ(second.exit_code, 3);
  EXPECT_THAT(second.err, HasSubstr("one.comap"));
}

}  // namespace
}  // namespace comap
