// Core and robots that know one address and use no multicast: they meet through a discovery server.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <functional>
#include <nlohmann/json.hpp>
#include <thread>

#include "protocol/discovery/endpoint.h"
#include "tests/end_to_end/background.h"
#include "tests/end_to_end/flat_test.h"

namespace comap {
namespace {

using Json = nlohmann::json;
using Words = std::vector<std::string>;

class Discovery : public FlatTest {
 protected:
  std::unique_ptr<Background> server() {
    return std::make_unique<Background>("fleet", Words{"discovery", "--listen", address_}, folder_.path("server.log"));
  }
  std::unique_ptr<Background> core(const std::string& site, const Words& more) {
    Words words = {"--domain", "92", "--core-site", site, "--store", store(site)};
    words.insert(words.end(), more.begin(), more.end());
    return std::make_unique<Background>("mapping_core", words, folder_.path(site + ".core.log"));
  }
  std::unique_ptr<Background> agent(const std::string& site, const std::string& robot, int patience_s,
                                    const Words& more) {
    Words words = {"--domain", "92",       "--core-site",      site,         "--robot",
                   robot,      "--outbox", folder_.path(site), "--patience", std::to_string(patience_s)};
    words.insert(words.end(), more.begin(), more.end());
    return std::make_unique<Background>("edge_agent", words, folder_.path(robot + ".log"));
  }
  std::string recording(const std::string& robot, int end) {
    return "tum:" + flat_ + "/" + robot + "@0:" + std::to_string(end);
  }
  std::string store(const std::string& site) { return folder_.path(site + ".comap"); }
  Json info(const std::string& site) {
    const ProgramRun run = runProgram("fleet info --json " + store(site));
    return run.exit_code == 0 ? Json::parse(run.out) : Json();
  }
  int keyframes(const std::string& site) {
    const Json told = info(site);
    return told.is_null() ? 0 : told.at("keyframes").get<int>();
  }
  static bool await(const std::function<bool()>& what) {
    for (int i = 0; i < 600; ++i) {
      if (what()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    return false;
  }
  std::string log(const std::string& name) { return contentOf(folder_.path(name + ".log")); }

  // A port that nobody has now.
  static std::string freeAddress() {
    const auto socket = DatagramSocket::bind({0x7f000001, 0, 0});
    EXPECT_TRUE(socket);
    return "127.0.0.1:" + std::to_string(socket->port());
  }

  const std::string address_ = freeAddress();
  // These tests may run side by side.
  const std::string site_ = "met-" + std::to_string(getpid()), other_ = "attic-" + std::to_string(getpid());
};

TEST_F(Discovery, RobotsMeetTheirCoreThroughAServerThatIsKilledAndStartedAgain) {
  const Words here = {"--discovery", address_};
  auto first_server = server();
  auto core_here = core(site_, here), core_there = core(other_, here);
  auto stranger = agent(other_, "s", 120, {"--discovery", address_, "--source", recording("a", 30)});
  auto a = agent(site_, "a", 120, {"--discovery", address_, "--source", recording("a", 120), "--realtime"});
  ASSERT_TRUE(await([&] { return keyframes(site_) >= 1 && keyframes(other_) >= 1; }))
      << log("a") << log("s") << log(site_ + ".core") << log(other_ + ".core") << log("server");
  EXPECT_EQ(first_server->end(SIGKILL), 128 + SIGKILL);
  auto b = agent(site_, "b", 120, {"--discovery", address_, "--source", recording("b", 120), "--realtime"});
  EXPECT_EQ(a->wait(), 0) << "who has met goes on without the server: " << log("a");
  EXPECT_EQ(stranger->wait(), 0) << log("s");
  ASSERT_TRUE(await([&] { return log("b").find("does not answer") != std::string::npos; })) << log("b");
  EXPECT_EQ(info(site_).at("robots").size(), 1u);

  auto second_server = server();
  EXPECT_EQ(b->wait(), 0) << log("b");
  EXPECT_EQ(core_here->end(SIGTERM), 0) << log(site_ + ".core");
  EXPECT_EQ(core_there->end(SIGTERM), 0) << log(other_ + ".core");
  EXPECT_EQ(second_server->end(SIGTERM), 0) << log("server");

  const Json met = info(site_), apart = info(other_);
  ASSERT_EQ(met.at("maps").size(), 1u) << met.dump(2);
  EXPECT_EQ(met.at("maps")[0].at("robots"), (Json{"a", "b"}));
  ASSERT_EQ(apart.at("robots").size(), 1u) << apart.dump(2);
  EXPECT_EQ(met.at("robots").size(), 2u) << met.dump(2);
  EXPECT_GT(apart.at("keyframes").get<int>(), 0);
}

TEST_F(Discovery, WithoutAnAnswerTheReasonIsSaidAndNothingElseIsTried) {
  auto core_here = core(site_, {});
  auto lost = agent(site_, "a", 9, {"--discovery", address_, "--source", recording("a", 10)});
  EXPECT_EQ(lost->wait(), 3) << log("a");
  const std::string told = log("a");
  EXPECT_NE(told.find("no mapping core answers in site '" + site_), std::string::npos) << told;
  EXPECT_NE(told.find("; discovery server " + address_ + " does not answer: is it running there"), std::string::npos)
      << told;
  // The core is there, and by multicast would have been found.
  auto found = agent(site_, "b", 60, {"--source", recording("a", 10)});
  EXPECT_EQ(found->wait(), 0) << log("b");
}

TEST_F(Discovery, ACoreCanBeTheServerItself) {
  const std::string port = address_.substr(address_.find(':') + 1);
  auto core_here = core(site_, {"--serve-discovery", port});
  auto a = agent(site_, "a", 60, {"--discovery", "127.0.0.1:" + port, "--source", recording("a", 30)});
  EXPECT_EQ(a->wait(), 0) << log("a");
  const ProgramRun asked = runProgram("fleet discovery --ask " + address_ + " --domain 92 --site " + site_);
  EXPECT_EQ(asked.exit_code, 0) << asked.err;
  EXPECT_NE(asked.out.find("1 cores"), std::string::npos) << asked.out;
  EXPECT_EQ(core_here->end(SIGTERM), 0) << log(site_ + ".core");
  EXPECT_GT(keyframes(site_), 0);
  const ProgramRun unanswered = runProgram("fleet discovery --ask " + address_);
  EXPECT_EQ(unanswered.exit_code, 3);
  EXPECT_NE(unanswered.err.find("no discovery server answers at " + address_), std::string::npos) << unanswered.err;
}

TEST_F(Discovery, WrongOptionsAreWrongUse) {
  const std::string agent = "edge_agent --robot a --outbox memory --source " + recording("a", 10) + " ";
  for (const auto& [command, text] : std::vector<std::pair<std::string, std::string>>{
           {"mapping_core --serve-discovery 7399 --discovery 10.0.0.1", "give one of them"},
           {"mapping_core --discovery 10.0.0", "link.discovery_server '10.0.0' is no HOST or HOST:PORT"},
           {agent + "--discovery :7399", "link.discovery_server ':7399'"},
           {"fleet discovery --listen here", "--listen 'here': expected an IPv4 address"},
           {"fleet watch --discovery a:b", "link.discovery_server 'a:b'"}}) {
    const ProgramRun run = runProgram(command);
    EXPECT_EQ(run.exit_code, 2) << command << ": " << run.err;
    EXPECT_NE(run.err.find(text), std::string::npos) << command << ": " << run.err;
  }
}

}  // namespace
}  // namespace comap
