// Keys as people use them: made by fleet, given to the programs.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/end_to_end/background.h"
#include "tests/end_to_end/flat_test.h"

namespace comap {
namespace {

using Json = nlohmann::json;

class Keys : public FlatTest {
 protected:
  void SetUp() override {
    FlatTest::SetUp();
    if (IsSkipped()) return;
    keys_ = folder_.path("keys");
    run("fleet keys init " + keys_ + " --site flat");
    for (const char* add : {"add-core KEYS", "add-robot KEYS a", "add-robot KEYS b", "add-tool KEYS"}) {
      std::string command = std::string("fleet keys ") + add;
      run(command.replace(command.find("KEYS"), 4, keys_));
    }
  }
  static void run(const std::string& command) {
    const ProgramRun done = runProgram(command);
    ASSERT_EQ(done.exit_code, 0) << command << ": " << done.err;
  }
  static void expectRefusal(const std::string& command, int exit_code, const std::string& text) {
    const ProgramRun done = runProgram(command);
    EXPECT_EQ(done.exit_code, exit_code) << command << ": " << done.err;
    EXPECT_NE(done.err.find(text), std::string::npos) << command << ": " << done.err;
  }

  std::string keys_;
};

TEST_F(Keys, AFleetWithKeysMakesOneMap) {
  const std::string out = folder_.path("run");
  const ProgramRun done = runProgram("fleet replay --json --keys " + keys_ + " --robot a=" + flat_ +
                                     "/a --robot b=" + flat_ + "/b --out " + out);
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const Json report = Json::parse(done.out);
  ASSERT_EQ(report.at("maps").size(), 1u) << report.dump(2);
  for (const auto& [name, robot] : report.at("robots").items()) {
    EXPECT_EQ(robot.at("keyframes_lost"), 0) << name;
    EXPECT_GT(robot.at("tiles_held").get<int>(), 5) << name;
  }
  EXPECT_NE(contentOf(out + "/logs/core.log").find("site flat"), std::string::npos);
}

TEST_F(Keys, MissingOrWrongOnesEndTheProgramsWithASentence) {
  const std::string agent = "edge_agent --source tum:" + flat_ + "/a --outbox memory --core-site flat ";
  expectRefusal(agent + "--robot c --keys " + keys_ + "/c", 3, "is no folder that can be read: 'fleet keys'");
  expectRefusal(agent + "--robot b --keys " + keys_ + "/a", 2, "is of robot 'a' of site 'flat', this robot is 'b'");
  expectRefusal("mapping_core --core-site flat --store " + folder_.path("x.comap") + " --keys " + keys_ + "/a", 2,
                "this is a ");
  expectRefusal(
      "fleet replay --link loopback --keys " + keys_ + " --robot a=" + flat_ + "/a --out " + folder_.path("r"), 2,
      "loopback has no wire");
  expectRefusal("fleet replay --keys " + keys_ + " --robot c=" + flat_ + "/a@0:5 --out " + folder_.path("r"), 3,
                "--keys " + keys_ + ": " + keys_ + "/c/");
  EXPECT_FALSE(std::filesystem::exists(folder_.path("r"))) << "told before anything is started";
  std::filesystem::create_symlink(folder_.path("loop"), folder_.path("loop"));
  for (const char* verb : {"show ", "revoke ", "add-robot "})
    expectRefusal("fleet keys " + std::string(verb) + folder_.path("loop") + " a", 3, folder_.path("loop"));
  expectRefusal("fleet keys show " + folder_.path("loop"), 3, folder_.path("loop") + ": cannot be read: ");
}

TEST_F(Keys, ARobotWhoseKeyIsRevokedLosesTheRunningCoreAndAnotherKeepsIt) {
  const std::string store = folder_.path("m.comap"), robot_a = folder_.path("on-a");
  std::filesystem::copy(keys_ + "/a", robot_a, std::filesystem::copy_options::recursive);  // nobody brings it the list
  const std::vector<std::string> common = {"--domain", "92", "--core-site", "flat"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.end(), common.begin(), common.end());
    return more;
  };
  const auto robot = [&](const std::string& name, const std::string& keys, const std::string& patience_s) {
    return std::make_unique<Background>("edge_agent",
                                        with({"--robot", name, "--keys", keys, "--source", "tum:" + flat_ + "/" + name,
                                              "--realtime", "--outbox", folder_.path(), "--patience", patience_s}),
                                        folder_.path(name + ".log"));
  };
  Background core("mapping_core", with({"--store", store, "--keys", keys_ + "/core"}), folder_.path("core.log"));
  const auto a = robot("a", robot_a, "8"), b = robot("b", keys_ + "/b", "60");
  const auto await = [&](const std::string& log, const std::string& text) {
    for (int i = 0; i < 600; ++i) {
      if (contentOf(folder_.path(log)).find(text) != std::string::npos) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    return false;
  };
  ASSERT_TRUE(await("core.log", "robot a is here") && await("core.log", "robot b is here"))
      << contentOf(folder_.path("core.log"));
  run("fleet keys revoke " + keys_ + " a");
  EXPECT_TRUE(await("core.log", "certificates more: joining anew")) << contentOf(folder_.path("core.log"));
  EXPECT_EQ(b->wait(), 0) << contentOf(folder_.path("b.log"));
  a->end(SIGTERM);  // whatever it had sent by then
  const auto again = robot("a", robot_a, "5");
  EXPECT_EQ(again->wait(), 3) << contentOf(folder_.path("a.log"));
  EXPECT_NE(
      contentOf(folder_.path("a.log")).find("does not let this robot in: ask the fleet's operator whether its keys"),
      std::string::npos)
      << contentOf(folder_.path("a.log"));
  EXPECT_TRUE(await("core.log", "comap/robot/a was not let in: its certificate is revoked"))
      << contentOf(folder_.path("core.log"));
  EXPECT_NE(contentOf(folder_.path("a.log")).find("keyframes wait in "), std::string::npos);
  EXPECT_EQ(core.end(SIGTERM), 0) << contentOf(folder_.path("core.log"));
}

TEST_F(Keys, CheckConfigLooksIntoTheFilesOfKeys) {
  const std::string config = folder_.write("robot.yaml", "robot: a\nlink:\n  site: flat\n  keys: " + keys_ + "/a\n");
  const std::string check = "edge_agent --check-config --config " + config;
  EXPECT_EQ(runProgram(check).exit_code, 0) << runProgram(check).err;
  expectRefusal(check + " --robot b", 2, "is of robot 'a' of site 'flat', this robot is 'b'");
  expectRefusal("mapping_core --check-config --core-site flat --keys " + keys_ + "/b", 2, "this is a core");
  expectRefusal("mapping_core --check-config --core-site flat --keys " + keys_ + "/nobody", 3, "keys/nobody");
  std::filesystem::copy_file(keys_ + "/b/key.pem", keys_ + "/a/key.pem",
                             std::filesystem::copy_options::overwrite_existing);
  expectRefusal(check, 3, "key.pem");
}

TEST_F(Keys, ShowAndRevokeTellWhatCounts) {
  ProgramRun shown = runProgram("fleet keys show " + keys_);
  EXPECT_EQ(shown.exit_code, 0) << shown.err;
  for (const char* text : {"robot 'a' of site 'flat', valid from 20", "core 'core'", "tool 'tool'"})
    EXPECT_NE(shown.out.find(text), std::string::npos) << shown.out;
  expectRefusal("fleet keys add-robot " + keys_ + " a", 2, "never overwritten");
  expectRefusal("fleet keys init " + keys_ + " --site flat", 2, "not empty");
  expectRefusal("fleet keys add-robot " + folder_.path("nowhere") + " a", 3, "'fleet keys init'");

  const ProgramRun revoked = runProgram("fleet keys revoke " + keys_ + " a");
  EXPECT_EQ(revoked.exit_code, 0) << revoked.err;
  EXPECT_NE(revoked.out.find(keys_ + "/core/revoked.pem"), std::string::npos) << revoked.out;
  shown = runProgram("fleet keys show " + keys_);
  EXPECT_EQ(shown.exit_code, 0) << "what is revoked is as it should be: " << shown.err;
  EXPECT_NE(shown.out.find("revoked, says"), std::string::npos) << shown.out;
  std::filesystem::remove(keys_ + "/core/permissions.p7s");
  EXPECT_EQ(runProgram("fleet keys show " + keys_).exit_code, 1);
}

}  // namespace
}  // namespace comap
