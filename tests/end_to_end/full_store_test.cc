// A store that may not grow: the core says so and acknowledges nothing more, robots keep their keyframes, and when
// there is room again all of them come.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "tests/end_to_end/background.h"
#include "tests/end_to_end/flat_test.h"
#include "tests/protocol/telemetry/http_get.h"

namespace comap {
namespace {

using Json = nlohmann::json;
using testing::HasSubstr;

class FullStore : public FlatTest {
 protected:
  bool awaitLine(const std::string& log, const std::string& text, Background& core) {
    for (int i = 0; i < 1200 && core.runs(); ++i) {
      if (contentOf(log).find(text) != std::string::npos) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    return false;
  }
  // What /readyz answers is told once a second.
  static bool awaitAnswer(int port, int status, Background& core) {
    for (int i = 0; i < 600 && core.runs(); ++i) {
      if (httpGet(port, "/readyz").status == status) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    return false;
  }
  static size_t errorsIn(const std::string& log) {
    size_t count = 0;
    std::istringstream lines(contentOf(log));
    for (std::string line; std::getline(lines, line);) count += Json::parse(line).at("level") == "error";
    return count;
  }
  Json info() {
    const ProgramRun run = runProgram("fleet info --json " + store_);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return run.exit_code == 0 ? Json::parse(run.out) : Json();
  }
  std::vector<std::string> coreArguments(int port) const {
    return {"--domain",           "94",           "--core-site", site_, "--store", store_, "--status-port",
            std::to_string(port), "--log-format", "json"};
  }
  std::vector<std::string> agentArguments() const {
    return {"--domain",
            "94",
            "--core-site",
            site_,
            "--robot",
            "a",
            "--source",
            "tum:" + flat_ + "/a@0:60",
            "--realtime",
            "--report",
            folder_.path("a.json"),
            "--patience",
            "120",
            "--outbox",
            folder_.path("outbox")};
  }
  // No file that the process writes grows beyond this.
  static void limitFiles(pid_t process, rlim_t bytes) {
    const rlimit limit{bytes, RLIM_INFINITY};
    ASSERT_EQ(prlimit(process, RLIMIT_FSIZE, &limit, nullptr), 0);
  }

  const std::string site_ = "full-" + std::to_string(getpid());
  const std::string store_ = folder_.path("map.comap"), core_log_ = folder_.path("core.log");
};

TEST_F(FullStore, NothingIsAcknowledgedThatIsNotThereAndAllComesWhenThereIsRoom) {
  const int port = freePort();
  Background core("mapping_core", coreArguments(port), core_log_);
  ASSERT_TRUE(awaitLine(core_log_, "mapping core on", core)) << contentOf(core_log_);
  limitFiles(core.pid(), 600'000);
  Background agent("edge_agent", agentArguments(), folder_.path("a.log"));
  ASSERT_TRUE(awaitLine(core_log_, "the store takes no keyframes", core)) << contentOf(core_log_);
  EXPECT_THAT(contentOf(core_log_), HasSubstr(store_));
  EXPECT_TRUE(agent.runs());
  EXPECT_TRUE(awaitAnswer(port, 503, core));
  EXPECT_THAT(httpGet(port, "/readyz").body, HasSubstr("the store takes no keyframes: "));
  EXPECT_THAT(httpGet(port, "/metrics").body, HasSubstr("comap_core_store_failing 1\n"));
  EXPECT_EQ(httpGet(port, "/healthz").status, 200) << "a new start would not help";

  limitFiles(core.pid(), RLIM_INFINITY);
  EXPECT_EQ(agent.wait(), 0) << contentOf(folder_.path("a.log"));
  EXPECT_THAT(contentOf(core_log_), HasSubstr("the store takes keyframes again"));
  EXPECT_TRUE(awaitAnswer(port, 200, core));
  EXPECT_THAT(httpGet(port, "/metrics").body, HasSubstr("comap_core_store_failing 0\n"));
  EXPECT_EQ(errorsIn(core_log_), 1u) << contentOf(core_log_);
  EXPECT_EQ(core.end(SIGTERM), 0) << contentOf(core_log_);
  const Json after = info(), report = Json::parse(contentOf(folder_.path("a.json")));
  EXPECT_EQ(after.at("keyframes"), report.at("keyframes"));
  EXPECT_GT(report.at("keyframes").get<int>(), 3);
  EXPECT_EQ(after.at("keyframes_without_pose"), 0);
}

TEST_F(FullStore, ADeletedStoreTakesNothingAndPutBackItTakesAll) {
  const int port = freePort();
  Background core("mapping_core", coreArguments(port), core_log_);
  ASSERT_TRUE(awaitLine(core_log_, "mapping core on", core)) << contentOf(core_log_);
  Background agent("edge_agent", agentArguments(), folder_.path("a.log"));
  ASSERT_TRUE(awaitLine(core_log_, "robot a is here", core)) << contentOf(core_log_);
  std::filesystem::rename(store_, folder_.path("aside"));
  ASSERT_TRUE(awaitLine(core_log_, "was deleted or moved away while this core writes it", core))
      << contentOf(core_log_);
  EXPECT_TRUE(awaitAnswer(port, 503, core));
  EXPECT_THAT(httpGet(port, "/metrics").body, HasSubstr("comap_core_store_failing 1\n"));
  EXPECT_TRUE(agent.runs());
  std::filesystem::rename(folder_.path("aside"), store_);
  EXPECT_EQ(agent.wait(), 0) << contentOf(folder_.path("a.log"));
  EXPECT_THAT(contentOf(core_log_), HasSubstr("the store takes keyframes again"));
  EXPECT_EQ(core.end(SIGTERM), 0) << contentOf(core_log_);
  const Json after = info(), report = Json::parse(contentOf(folder_.path("a.json")));
  EXPECT_EQ(after.at("keyframes"), report.at("keyframes"));
  EXPECT_EQ(after.at("keyframes_without_pose"), 0);
}

TEST_F(FullStore, ACoreThatStartsOnAStoreThatMayNotGrowSaysSo) {
  ASSERT_EQ(
      runProgram("fleet replay --link loopback --robot a=" + flat_ + "/a@0:30 --out " + folder_.path("run")).exit_code,
      0);
  const std::string full = folder_.path("run/map.comap");
  const ProgramRun run =
      runProgram("mapping_core --domain 94 --core-site " + site_ + " --store " + full, "prlimit --fsize=20000");
  EXPECT_EQ(run.exit_code, 3) << run.err;
  EXPECT_THAT(run.err, HasSubstr(full));
}

}  // namespace
}  // namespace comap
