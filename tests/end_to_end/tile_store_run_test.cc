// A robot that is started again has what it held before, and is sent only what has changed.
#include <gtest/gtest.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "tests/end_to_end/background.h"
#include "tests/end_to_end/flat_test.h"

namespace comap {
namespace {

using Json = nlohmann::json;

class TilesOnDisk : public FlatTest {
 protected:
  Json run(const std::string& frames, int signal = 0) {
    const std::string report = folder_.path("a.json"), log = folder_.path("a" + std::to_string(++runs_) + ".log");
    unlink(report.c_str());
    Background agent("edge_agent",
                     {"--domain", "98", "--core-site", site_, "--robot", "a", "--source",
                      "tum:" + flat_ + "/a@" + frames, "--outbox", folder_.path("state"), "--report", report},
                     log);
    if (signal != 0) {  // in the middle of what it does
      const auto isMapped = [&] { return contentOf(log).find("now in map") != std::string::npos; };
      for (int i = 0; i < 1200 && agent.runs() && !isMapped(); ++i) usleep(50'000);
      EXPECT_TRUE(isMapped()) << contentOf(log);
      usleep(500'000);
      EXPECT_EQ(agent.end(signal), 128 + signal);
      return {};
    }
    EXPECT_EQ(agent.wait(), 0) << contentOf(log);
    return Json::parse(contentOf(report));
  }

  int runs_ = 0;  // each has its own log
  const std::string site_ = "tiles-" + std::to_string(getpid());
};

TEST_F(TilesOnDisk, AfterARestartOnlyChangesCome) {
  Background core("mapping_core", {"--domain", "98", "--core-site", site_, "--store", folder_.path("m.comap")},
                  folder_.path("core.log"));
  const Json first = run("0:120");
  EXPECT_EQ(first.at("tiles_from_disk").get<int>(), 0);
  EXPECT_GT(first.at("tiles_held").get<int>(), 50);
  run("0:60", SIGKILL);
  const Json again = run("0:60");
  const std::string log = contentOf(folder_.path("a3.log"));
  EXPECT_EQ(again.at("map"), first.at("map")) << log;
  EXPECT_NE(log.find("tiles of map " + first.at("map").get<std::string>() + " are known from before"),
            std::string::npos)
      << log;
  EXPECT_EQ(log.find("dropped"), std::string::npos) << log;
  EXPECT_GT(again.at("tiles_from_disk").get<int>(), first.at("tiles_held").get<int>() / 2);
  EXPECT_GE(again.at("tiles_held").get<int>(), first.at("tiles_held").get<int>() / 2);
  EXPECT_EQ(core.end(SIGTERM), 0);
}

}  // namespace
}  // namespace comap
