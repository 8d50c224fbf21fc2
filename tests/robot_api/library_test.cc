// What stays the same for programs that were built against an older libcomap_robot.so.1, and wrong use of it.
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cstddef>
#include <cstdio>
#include <set>
#include <string>
#include <thread>

#include "protocol/types/local_socket.h"
#include "robot_api/comap_robot.h"
#include "robot_api/comap_robot.hpp"
#include "tests/files/temporary_folder.h"

extern "C" int c_sees_pose_size(void);

namespace {

std::string outputOf(const std::string& command) {
  FILE* pipe = popen(command.c_str(), "r");
  std::string out;
  std::array<char, 4096> part;
  for (size_t n = 0; (n = std::fread(part.data(), 1, part.size(), pipe)) > 0;) out.append(part.data(), n);
  EXPECT_EQ(pclose(pipe), 0) << command;
  return out;
}

TEST(RobotLibrary, ExportsItsFunctionsAndNothingElse) {
  const std::set<std::string> expected = {
      "comap_robot_connect",       "comap_robot_connected",        "comap_robot_error",
      "comap_robot_free",          "comap_robot_latest_pose",      "comap_robot_name",
      "comap_robot_new",           "comap_robot_read_surfels",     "comap_robot_session",
      "comap_robot_surfels_count", "comap_robot_surfels_data",     "comap_robot_surfels_free",
      "comap_robot_surfels_map",   "comap_robot_surfels_snapshot", "comap_robot_surfels_tile_count",
      "comap_robot_surfels_tiles", "comap_robot_version",          "comap_robot_wait_pose"};
  std::set<std::string> exported;
  const std::string symbols = outputOf("nm -D --defined-only " COMAP_ROBOT_LIBRARY);
  for (size_t at = 0; at < symbols.size();) {
    const size_t end = symbols.find('\n', at);
    const std::string line = symbols.substr(at, end - at);
    at = end + 1;
    const size_t name = line.rfind(' ');
    if (line.find(" A ") != std::string::npos) continue;  // the version's own name
    const std::string symbol = line.substr(name + 1);
    EXPECT_TRUE(symbol.ends_with("@@COMAP_ROBOT_1")) << symbol;
    exported.insert(symbol.substr(0, symbol.find('@')));
  }
  EXPECT_EQ(exported, expected);
  EXPECT_NE(outputOf("readelf -d " COMAP_ROBOT_LIBRARY).find("[libcomap_robot.so.1]"), std::string::npos);
}

TEST(RobotLibrary, LayoutIsThatOfItsFirstRelease) {
  EXPECT_EQ(sizeof(comap_robot_pose), 744u);
  EXPECT_EQ(c_sees_pose_size(), 744);
  EXPECT_EQ(offsetof(comap_robot_pose, sequence), 16u);
  EXPECT_EQ(offsetof(comap_robot_pose, map), 48u);
  EXPECT_EQ(offsetof(comap_robot_pose, T_map_cam), 176u);
  EXPECT_EQ(offsetof(comap_robot_pose, T_odom_cam), 400u);
  EXPECT_EQ(offsetof(comap_robot_pose, covariance), 456u);
  EXPECT_EQ(sizeof(comap_robot_surfel), 36u);
  EXPECT_EQ(sizeof(comap_robot_tile), 32u);
  EXPECT_EQ(sizeof(comap_robot_box), 48u);
}

TEST(RobotLibrary, WrongUseIsToldAndCrashesNothing) {
  comap_robot_pose pose{};
  EXPECT_EQ(comap_robot_latest_pose(nullptr, &pose), COMAP_ROBOT_WRONG_USE);
  comap_robot* robot = comap_robot_new();
  ASSERT_NE(robot, nullptr);
  EXPECT_STREQ(comap_robot_error(robot), "");
  EXPECT_EQ(comap_robot_latest_pose(robot, &pose), COMAP_ROBOT_WRONG_USE) << "its size is not set";
  EXPECT_NE(std::string(comap_robot_error(robot)).find("size"), std::string::npos);
  pose.size = sizeof pose;
  EXPECT_EQ(comap_robot_latest_pose(robot, nullptr), COMAP_ROBOT_WRONG_USE);
  EXPECT_EQ(comap_robot_wait_pose(robot, &pose, -1), COMAP_ROBOT_WRONG_USE);
  EXPECT_EQ(comap_robot_latest_pose(robot, &pose), COMAP_ROBOT_UNREACHABLE);
  EXPECT_STREQ(comap_robot_error(robot), "not connected");
  EXPECT_EQ(comap_robot_connect(robot, nullptr, 10), COMAP_ROBOT_WRONG_USE);
  EXPECT_EQ(comap_robot_connect(robot, "", 10), COMAP_ROBOT_WRONG_USE);
  EXPECT_EQ(comap_robot_connect(robot, std::string(300, 'x').c_str(), 10), COMAP_ROBOT_WRONG_USE);
  const comap_robot_box upside_down{{0, 0, 1}, {0, 0, 0}};
  comap_robot_surfels* answer = nullptr;
  EXPECT_EQ(comap_robot_read_surfels(robot, &upside_down, 0, 0, 10, &answer), COMAP_ROBOT_WRONG_USE);
  EXPECT_EQ(answer, nullptr);
  comap_robot_free(robot);
  comap_robot_free(nullptr);
  comap_robot_surfels_free(nullptr);
  EXPECT_EQ(comap_robot_surfels_count(nullptr), 0u);
}

TEST(RobotLibrary, NoAgentIsUnreachable) {
  try {
    comap_robot_api::Robot robot("/nonexistent/api", 10);
    FAIL() << "connected";
  } catch (const comap_robot_api::Error& error) {
    EXPECT_EQ(error.code(), COMAP_ROBOT_UNREACHABLE);
    EXPECT_NE(std::string(error.what()).find("/nonexistent/api"), std::string::npos) << error.what();
  }
}

// Who says `words` to the first who comes, and then nothing.
class Stranger {
 public:
  explicit Stranger(const std::string& path, const std::string& words) {
    listener_ = socket(AF_UNIX, SOCK_STREAM, 0);
    EXPECT_EQ(comap::bindSocket(listener_, path), 0);
    EXPECT_EQ(listen(listener_, 1), 0);
    thread_ = std::thread([this, words] {
      peer_ = accept(listener_, nullptr, nullptr);
      EXPECT_EQ(write(peer_, words.data(), words.size()), static_cast<ssize_t>(words.size()));
    });
  }
  ~Stranger() {
    thread_.join();
    close(peer_);
    close(listener_);
  }

 private:
  int listener_ = -1, peer_ = -1;
  std::thread thread_;
};

TEST(RobotLibrary, SomethingElseThatListensIsNoAgent) {
  comap::TemporaryFolder folder;
  comap_robot* robot = comap_robot_new();
  {
    Stranger web(folder.path("web"), "HTTP/1.1 400 Bad Request\r\n\r\n");
    EXPECT_EQ(comap_robot_connect(robot, folder.path("web").c_str(), 2000), COMAP_ROBOT_BAD_DATA);
  }
  EXPECT_EQ(comap_robot_connected(robot), 0);
  {
    Stranger mute(folder.path("mute"), "");
    EXPECT_EQ(comap_robot_connect(robot, folder.path("mute").c_str(), 50), COMAP_ROBOT_UNREACHABLE);
    EXPECT_NE(std::string(comap_robot_error(robot)).find("in time"), std::string::npos) << comap_robot_error(robot);
  }
  {
    // A greeting of another major version.
    std::string words(8 + 20, '\0');
    words[0] = 20;
    words[4] = 1;
    words.replace(8, 4, "CMAP");
    words[12] = 2;
    Stranger newer(folder.path("newer"), words);
    EXPECT_EQ(comap_robot_connect(robot, folder.path("newer").c_str(), 2000), COMAP_ROBOT_BAD_DATA);
    EXPECT_NE(std::string(comap_robot_error(robot)).find("major is 2"), std::string::npos) << comap_robot_error(robot);
  }
  comap_robot_free(robot);
}

}  // namespace
