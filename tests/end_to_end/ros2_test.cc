// What ROS 2 programs see of a fleet, read back by another vendor's DDS with ROS' own message definitions.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cmath>
#include <future>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/end_to_end/background.h"
#include "tests/end_to_end/flat_test.h"
#include "tests/protocol/telemetry/http_get.h"

namespace comap {
namespace {

using Json = nlohmann::json;

class Ros2 : public FlatTest {
 protected:
  void SetUp() override {
    FlatTest::SetUp();
    if (access(kListener.c_str(), X_OK) != 0)
      GTEST_SKIP()
          << "no other vendor's DDS: packages cyclonedds-dev and cyclonedds-tools were not there at build time";
  }

  // What the listener has read.
  Json listen(const std::string& arguments) const {
    const std::string command =
        "CYCLONEDDS_URI='<CycloneDDS><Domain><General><AllowMulticast>false</AllowMulticast><Interfaces>"
        "<NetworkInterface name=\"lo\" multicast=\"false\"/></Interfaces></General><Discovery>"
        "<ParticipantIndex>auto</ParticipantIndex><Peers><Peer address=\"127.0.0.1\"/></Peers></Discovery>"
        "</Domain></CycloneDDS>' timeout 90 " +
        kListener + " " + domain_ + " " + arguments;
    FILE* pipe = popen(command.c_str(), "r");
    std::string out;
    std::array<char, 4096> part;
    for (size_t n = 0; (n = std::fread(part.data(), 1, part.size(), pipe)) > 0;) out.append(part.data(), n);
    const int status = pclose(pipe);
    EXPECT_EQ(WEXITSTATUS(status), 0) << out;
    return Json::accept(out) ? Json::parse(out) : Json();
  }

  std::string config(const std::string& name) const {
    const std::string path = folder_.path(name);
    std::ofstream(path) << "ros2:\n  enabled: true\n  domain: " << domain_ << "\n";
    return path;
  }

  const std::string kListener = std::string(COMAP_BIN_DIR) + "/../tests/ros2_listener";
  const std::string domain_ = std::to_string(60 + getpid() % 30);
  const std::string site_ = "ros2-" + std::to_string(getpid());
};

TEST_F(Ros2, ProgramsSeeRobotAndMapAsTheirOwn) {
  const int port = freePort();
  Background core("mapping_core",
                  {"--config", config("core.yaml"), "--domain", "96", "--core-site", site_, "--store",
                   folder_.path("m.comap"), "--status-port", std::to_string(port)},
                  folder_.path("core.log"));
  for (int i = 0; i < 300 && httpGet(port, "/readyz").status != 200; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  // Who listens is there before the robot, whose recording lasts 4 s.
  auto heard = std::async(std::launch::async, [&] { return listen("robot_1 with_map"); });
  std::this_thread::sleep_for(std::chrono::seconds(2));
  Background agent("edge_agent",
                   {"--config", config("robot.yaml"), "--domain", "96", "--core-site", site_, "--robot", "robot-1",
                    "--source", "tum:" + flat_ + "/a", "--realtime", "--outbox", "memory"},
                   folder_.path("a.log"));
  const Json robot = heard.get();
  ASSERT_FALSE(robot.is_null()) << contentOf(folder_.path("a.log"));
  const Json& odom = robot.at("odom");
  EXPECT_EQ(odom.at("frame"), "robot_1/odom");
  EXPECT_EQ(odom.at("child"), "robot_1/base_link");
  EXPECT_GT(odom.at("stamp_ns").get<int64_t>(), 0);
  EXPECT_EQ(odom.at("covariance_sum"), 0);
  double speed = 0;
  for (const Json& v : odom.at("linear")) speed += std::pow(v.get<double>(), 2);
  EXPECT_LT(std::sqrt(speed), 3);  // m/s, of somebody who walks
  EXPECT_EQ(robot.at("path").at("frame"), "robot_1/odom");
  EXPECT_GE(robot.at("path").at("poses").get<int>(), 1);
  EXPECT_EQ(robot.at("tracking_state"), "ok");
  const Json& fixed = robot.at("tf_static").at(0);
  EXPECT_EQ(fixed.at("frame"), "robot_1/base_link");
  EXPECT_EQ(fixed.at("child"), "robot_1/camera");
  const auto q = fixed.at("rotation").get<std::array<double, 4>>();  // the usual -0.5 0.5 -0.5 0.5 of optical frames
  for (size_t i = 0; i < 4; ++i) EXPECT_NEAR(q[i] / q[3], i % 2 == 0 ? -1 : 1, 1e-6) << fixed;
  ASSERT_EQ(robot.at("tf").size(), 2u);
  EXPECT_EQ(robot.at("tf").at(0).at("child"), "robot_1/base_link");
  EXPECT_EQ(robot.at("tf").at(1).at("child"), "robot_1/odom");
  const std::string map = robot.at("tf").at(1).at("frame");
  EXPECT_TRUE(map.starts_with("map/robot-1-")) << map;

  const Json cloud = listen("robot_1 map");
  ASSERT_FALSE(cloud.is_null()) << contentOf(folder_.path("core.log"));
  EXPECT_EQ(cloud.at("frame"), map);
  EXPECT_EQ(cloud.at("fields"), "x y z rgb");
  EXPECT_EQ(cloud.at("height"), 1);
  EXPECT_EQ(cloud.at("step"), 16);
  EXPECT_EQ(cloud.at("bytes").get<uint32_t>(), cloud.at("row").get<uint32_t>());
  EXPECT_EQ(cloud.at("bytes").get<uint32_t>(), 16 * cloud.at("width").get<uint32_t>());
  EXPECT_LE(cloud.at("width").get<uint32_t>(), 100'000u);
  EXPECT_GT(cloud.at("width").get<uint32_t>(), 1000u);
  for (size_t k = 0; k < 3; ++k) {  // metres, of a flat
    EXPECT_GT(cloud.at("low").at(k).get<double>(), -15);
    EXPECT_LT(cloud.at("high").at(k).get<double>(), 15);
  }
  EXPECT_LT(cloud.at("high").at(2).get<double>() - cloud.at("low").at(2).get<double>(), 4);  // z is up: a room's height
  agent.end(SIGTERM);
  EXPECT_EQ(core.end(SIGTERM), 0);
}

TEST(Ros2Options, TheFleetsOwnDomainIsRefusedAndLeavesNothing) {
  TemporaryFolder folder;
  const ProgramRun run = runProgram("mapping_core --ros2 --domain 0 --store " + folder.path("m.comap"));
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_NE(run.err.find("ros2.domain"), std::string::npos) << run.err;
  EXPECT_NE(access(folder.path("m.comap").c_str(), F_OK), 0);
}

TEST(Ros2Options, AnAddressOfAnotherMachineIsRefused) {
  TemporaryFolder folder;
  for (const char* address : {"203.0.113.7", "eth0", "0.0.0.0"}) {
    std::ofstream(folder.path("core.yaml")) << "ros2: {enabled: true, interface_address: \"" << address << "\"}\n";
    const ProgramRun run = runProgram("mapping_core --check-config --config " + folder.path("core.yaml"));
    EXPECT_EQ(run.exit_code, 3) << address;
    EXPECT_NE(run.err.find(address), std::string::npos) << run.err;
  }
}

}  // namespace
}  // namespace comap
