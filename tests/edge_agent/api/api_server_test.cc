// Server and library together, over a real socket.
#include "edge_agent/api/api_server.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstring>
#include <fstream>

#include "protocol/types/local_socket.h"
#include "protocol/types/tile_quantisation.h"
#include "robot_api/comap_robot.hpp"
#include "tests/files/temporary_folder.h"

namespace comap {
namespace {

using comap_robot_api::Robot;

// A tile whose every byte follows from `seed`.
std::shared_ptr<const Tile> tileOf(int x, uint64_t revision, int surfels, uint32_t seed) {
  Tile tile;
  tile.key = {"m", x, -x, 3};
  tile.revision = revision;
  for (int i = 0; i < surfels; ++i) {
    seed = seed * 1664525u + 1013904223u;
    const auto byte = [&](int shift) { return static_cast<uint8_t>(seed >> shift); };
    tile.surfels.push_back({static_cast<uint16_t>(seed), static_cast<uint16_t>(seed >> 8),
                            static_cast<uint16_t>(seed >> 16), byte(3), byte(11), byte(1), byte(9), byte(17), byte(5),
                            byte(13), byte(21)});
  }
  return std::make_shared<const Tile>(std::move(tile));
}

ApiState stateOf(uint64_t sequence, uint64_t snapshot, std::vector<std::shared_ptr<const Tile>> tiles) {
  ApiState state;
  state.pose.sequence = sequence;
  state.pose.snapshot = snapshot;
  state.pose.map = "m";
  state.pose.T_map_cam = {1, 2, 3, 0, 0, 0, 1};
  state.pose.T_odom_cam = {0.1, 0.2, 0.3, 0.5, 0.5, 0.5, 0.5};
  state.pose.has_covariance = true;
  state.pose.covariance[35] = 1e-6;
  state.tiles = std::make_shared<const TileSnapshot>(TileSnapshot{snapshot, "m", std::move(tiles)});
  return state;
}

constexpr double kFar = 1e9;
constexpr comap_robot_box kEverything{{-kFar, -kFar, -kFar}, {kFar, kFar, kFar}};

class ApiServerTest : public testing::Test {
 protected:
  void start(bool group = false) {
    robot_api::Greeting greeting;
    greeting.session = 42;
    greeting.robot = "robot_1";
    auto server = ApiServer::start({path_, group}, greeting);
    ASSERT_TRUE(server) << server.error().text;
    server_ = std::move(*server);
  }
  mode_t mode() const {
    struct stat there {};
    EXPECT_EQ(stat(path_.c_str(), &there), 0);
    EXPECT_TRUE(S_ISSOCK(there.st_mode));
    return there.st_mode & 0777;
  }

  TemporaryFolder folder_;
  // A program that speaks for itself.
  int connected() const {
    const int fd = socket(AF_UNIX, SOCK_STREAM, 0);
    EXPECT_EQ(connectSocket(fd, path_), 0);
    return fd;
  }
  const std::string path_ = folder_.path("api");
  std::unique_ptr<ApiServer> server_;
};

TEST_F(ApiServerTest, TellsThePoseToTheBit) {
  start();
  Robot robot(path_);
  EXPECT_EQ(robot.name(), "robot_1");
  EXPECT_EQ(robot.session(), 42u);
  EXPECT_FALSE(robot.latestPose()) << "none yet";
  EXPECT_FALSE(robot.waitPose(0, 10));
  const ApiState state = stateOf(3, 1, {});
  server_->publish(state);
  const auto pose = robot.waitPose(0, 5000);
  ASSERT_TRUE(pose);
  EXPECT_EQ(pose->sequence, 3u);
  EXPECT_STREQ(pose->map, "m");
  EXPECT_EQ(pose->T_map_cam.z, 3);
  EXPECT_EQ(std::memcmp(&pose->T_odom_cam, state.pose.T_odom_cam.data(), sizeof pose->T_odom_cam), 0);
  EXPECT_EQ(std::memcmp(pose->covariance, state.pose.covariance.data(), sizeof pose->covariance), 0);
  EXPECT_EQ(pose->has_covariance, 1);
  EXPECT_FALSE(robot.waitPose(3, 10));
  EXPECT_TRUE(robot.latestPose());
}

TEST_F(ApiServerTest, WhoWaitsIsWokenByTheNextPose) {
  start();
  server_->publish(stateOf(1, 1, {}));
  std::jthread publisher([&] {
    for (uint64_t i = 2; i <= 50; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
      server_->publish(stateOf(i, 1, {}));
    }
  });
  Robot robot(path_);
  uint64_t last = 0;
  while (last < 50) {
    const auto pose = robot.waitPose(last, 5000);
    ASSERT_TRUE(pose) << "after " << last;
    EXPECT_GT(pose->sequence, last);
    last = pose->sequence;
  }
}

TEST_F(ApiServerTest, WhoHangsUpWhileWaitingMakesRoom) {
  start();
  std::vector<int> waiting;
  for (size_t i = 0; i < ApiServer::kMostReaders; ++i) {
    waiting.push_back(connected());
    const std::string ask = robot_api::encode(robot_api::AskPose{0, 60'000});
    ASSERT_EQ(write(waiting.back(), ask.data(), ask.size()), static_cast<ssize_t>(ask.size()));
  }
  EXPECT_THROW(Robot{path_}, std::runtime_error) << "they wait";
  for (const int fd : waiting) close(fd);
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  for (bool in = false; !in;) {
    ASSERT_LT(std::chrono::steady_clock::now(), end) << "though nothing was published meanwhile";
    try {
      Robot robot(path_);
      in = true;
    } catch (const std::runtime_error&) {
    }
  }
}

TEST_F(ApiServerTest, SurfelsOfABoxAreThoseOfTheTilesToTheBit) {
  start();
  const std::vector<std::shared_ptr<const Tile>> tiles{tileOf(-1, 5, 300, 1), tileOf(0, 6, 200, 2),
                                                       tileOf(7, 7, 100, 3)};
  server_->publish(stateOf(1, 9, tiles));
  Robot robot(path_);
  const comap_robot_box box{{-0.4, -0.3, 1.6}, {0.2, 0.9, 1.9}};
  for (const comap_robot_box& asked : {kEverything, box}) {
    const auto answer = robot.readSurfels(asked);
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->snapshot(), 9u);
    EXPECT_EQ(answer->map(), "m");
    size_t i = 0, t = 0;
    for (const auto& tile : tiles) {
      const size_t first = i;
      for (const TileSurfel& from : tile->surfels) {
        const TileDisc disc = dequantiseDisc(from, tile->key);
        bool within = true;
        for (int k = 0; k < 3; ++k)
          within = within && double{disc.position[k]} >= asked.min_m[k] && double{disc.position[k]} <= asked.max_m[k];
        if (!within) continue;
        ASSERT_LT(i, answer->surfels().size());
        const comap_robot_surfel& got = answer->surfels()[i++];
        EXPECT_EQ(std::memcmp(got.position_m, disc.position.data(), 12), 0);
        EXPECT_EQ(std::memcmp(got.normal, disc.normal.data(), 12), 0);
        EXPECT_EQ(std::memcmp(&got.radius_m, &disc.radius_m, 4), 0);
        EXPECT_EQ(got.r, from.r);
        EXPECT_EQ(got.b, from.b);
        EXPECT_EQ(got.confidence, from.confidence);
        EXPECT_EQ(got.contributors, from.contributors);
      }
      if (i == first) continue;
      ASSERT_LT(t, answer->tiles().size());
      const comap_robot_tile& got = answer->tiles()[t++];
      EXPECT_EQ(got.x, tile->key.x);
      EXPECT_EQ(got.y, tile->key.y);
      EXPECT_EQ(got.revision, tile->revision);
      EXPECT_EQ(got.first_surfel, first);
      EXPECT_EQ(got.surfels, i - first);
    }
    EXPECT_EQ(answer->surfels().size(), i);
    EXPECT_EQ(answer->tiles().size(), t);
    EXPECT_GT(i, 20u);
  }
  EXPECT_EQ(robot.readSurfels(kEverything)->surfels().size(), 600u);
  EXPECT_LT(robot.readSurfels(box)->surfels().size(), 300u);
  EXPECT_FALSE(robot.readSurfels(box, 9)) << "unchanged";
  EXPECT_THROW(robot.readSurfels(kEverything, 0, 599), comap_robot_api::Error);
  EXPECT_EQ(robot.readSurfels(kEverything, 0, 600)->surfels().size(), 600u) << "and the connection goes on";
}

// Tiles of each published state carry its number as revision: an answer with two would have mixed two states.
TEST_F(ApiServerTest, AnAnswerIsNeverMixedWhilePublishingGoesOn) {
  start();
  const auto stateAt = [](uint64_t n) {
    std::vector<std::shared_ptr<const Tile>> tiles;
    for (int x = 0; x < 60; ++x) tiles.push_back(tileOf(x, n, 500, static_cast<uint32_t>(n)));
    return stateOf(n, n, tiles);
  };
  server_->publish(stateAt(1));
  std::atomic<bool> done{false};
  std::thread publisher([&] {
    for (uint64_t n = 2; !done; ++n) {
      server_->publish(stateAt(n));
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
  });
  std::vector<std::thread> programs;
  for (int i = 0; i < 3; ++i)
    programs.emplace_back([&] {
      Robot robot(path_);
      for (int k = 0; k < 30; ++k) {
        const auto answer = robot.readSurfels(kEverything);
        ASSERT_TRUE(answer);
        ASSERT_EQ(answer->surfels().size(), 30'000u);
        for (const comap_robot_tile& tile : answer->tiles()) ASSERT_EQ(tile.revision, answer->snapshot());
      }
    });
  for (std::thread& program : programs) program.join();
  done = true;
  publisher.join();
}

TEST_F(ApiServerTest, AReaderThatTakesNothingHoldsUpNeitherThePublisherNorOthers) {
  start();
  std::vector<std::shared_ptr<const Tile>> tiles;
  for (int x = 0; x < 500; ++x) tiles.push_back(tileOf(x, 1, 2000, 4));  // 14 MB
  server_->publish(stateOf(1, 1, tiles));
  std::vector<int> sleepers;
  for (int i = 0; i < 8; ++i) {
    sleepers.push_back(connected());
    const std::string ask =
        robot_api::encode(robot_api::AskSurfels{{-kFar, -kFar, -kFar}, {kFar, kFar, kFar}, 0, 1u << 30});
    ASSERT_EQ(write(sleepers.back(), ask.data(), ask.size()), static_cast<ssize_t>(ask.size()));
  }
  Robot robot(path_);
  for (uint64_t n = 2; n < 200; ++n) {
    server_->publish(stateOf(n, 1, tiles));
    const auto pose = robot.waitPose(n - 1, 5000);
    ASSERT_TRUE(pose) << n;
    EXPECT_EQ(pose->sequence, n);
  }
  EXPECT_EQ(robot.readSurfels(kEverything)->surfels().size(), 1'000'000u);
  for (const int fd : sleepers) close(fd);
}

TEST_F(ApiServerTest, OneReaderTooManyIsTurnedAway) {
  start();
  std::vector<std::unique_ptr<Robot>> robots;
  for (size_t i = 0; i < ApiServer::kMostReaders; ++i) robots.push_back(std::make_unique<Robot>(path_));
  try {
    Robot robot(path_);
    FAIL() << "let in";
  } catch (const comap_robot_api::Error& error) {
    EXPECT_EQ(error.code(), COMAP_ROBOT_UNREACHABLE);
    EXPECT_NE(std::string(error.what()).find("16 readers"), std::string::npos) << error.what();
  }
  EXPECT_EQ(server_->takeNews().size(), 1u);
  EXPECT_TRUE(server_->takeNews().empty());
  robots.pop_back();
  for (int i = 0; i < 500; ++i) {  // until the server has seen it leave
    try {
      Robot robot(path_);
      return;
    } catch (const comap_robot_api::Error&) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }
  FAIL() << "a place that became free is given to nobody";
}

TEST_F(ApiServerTest, AnAgentThatEndsIsUnreachable) {
  start();
  server_->publish(stateOf(1, 1, {}));
  Robot robot(path_);
  ASSERT_TRUE(robot.latestPose());
  server_.reset();
  EXPECT_THROW(robot.latestPose(), comap_robot_api::Error);
  EXPECT_FALSE(robot.connected());
  EXPECT_NE(access(path_.c_str(), F_OK), 0) << "its name is taken away";
  start();
  robot.reconnect(path_);
  EXPECT_TRUE(robot.connected());
}

TEST_F(ApiServerTest, OnlyTheUserOrAlsoTheGroupMayRead) {
  const mode_t before = umask(0);
  start();
  EXPECT_EQ(mode(), 0600u);
  server_.reset();
  umask(077);
  start(true);
  EXPECT_EQ(mode(), 0660u);
  umask(before);
}

TEST_F(ApiServerTest, WhatIsAtItsPathAlreadyIsLeftUnlessItIsADeadSocket) {
  std::ofstream(path_) << "mine";
  const auto refused = ApiServer::start({path_, false}, {});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().text.find("no socket"), std::string::npos) << refused.error().text;
  std::string content;
  std::ifstream(path_) >> content;
  EXPECT_EQ(content, "mine");
  unlink(path_.c_str());

  start();
  const auto second = ApiServer::start({path_, false}, {});
  ASSERT_FALSE(second);
  EXPECT_NE(second.error().text.find("another agent"), std::string::npos) << second.error().text;
  Robot robot(path_);
  server_.reset();

  // As an agent that was killed leaves it.
  const int dead = socket(AF_UNIX, SOCK_STREAM, 0);
  ASSERT_EQ(bindSocket(dead, path_), 0);
  close(dead);
  start();
  EXPECT_NO_THROW(Robot{path_});

  EXPECT_EQ(ApiServer::start({std::string(200, 'x'), false}, {}).error().code, ErrorCode::kWrongUse);
  EXPECT_EQ(ApiServer::start({folder_.path("no/such/folder"), false}, {}).error().code, ErrorCode::kUnreachable);
}

}  // namespace
}  // namespace comap
