// What other programs on a robot read from its agent while it maps: the installed examples, against the agent's report.
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "protocol/types/tile_hash.h"
#include "protocol/types/tile_quantisation.h"
#include "tests/end_to_end/background.h"
#include "tests/end_to_end/flat_test.h"

namespace comap {
namespace {

using Json = nlohmann::json;

struct Told {
  uint64_t sequence = 0;
  int64_t stamp_ns = 0;
  int tracking = -1, map_state = -1;
  std::string map;
  Pose T_map_cam, T_odom_cam;
};

std::istream& operator>>(std::istream& in, Pose& pose) {
  Eigen::Vector3d t;
  Eigen::Quaterniond q;
  in >> t.x() >> t.y() >> t.z() >> q.x() >> q.y() >> q.z() >> q.w();
  pose = Pose(q, t);
  return in;
}

std::vector<Told> readFollowed(const std::string& path) {
  std::vector<Told> told;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    Told one;
    words >> one.sequence >> one.stamp_ns >> one.tracking >> one.map_state >> one.map >> one.T_map_cam >>
        one.T_odom_cam;
    if (words) told.push_back(one);
  }
  return told;
}

// The tiles whose surfels a point cloud of the example lists.
std::map<TileKey, Tile> readTiles(const std::string& path) {
  std::map<TileKey, Tile> tiles;
  std::ifstream file(path);
  std::string line;
  while (std::getline(file, line) && line != "end_header") {
  }
  while (std::getline(file, line)) {
    std::istringstream words(line);
    TileDisc disc;
    std::array<int, 5> rest{};
    words >> disc.position.x() >> disc.position.y() >> disc.position.z() >> disc.normal.x() >> disc.normal.y() >>
        disc.normal.z() >> disc.radius_m;
    for (int& value : rest) words >> value;
    EXPECT_TRUE(words) << line;
    const auto cell = [](float v) { return static_cast<int32_t>(std::floor(double{v} / double{kTileEdge_m})); };
    TileKey key{"", cell(disc.position.x()), cell(disc.position.y()), cell(disc.position.z())};
    TileSurfel surfel;
    quantiseDisc(disc, key, surfel);
    surfel.r = static_cast<uint8_t>(rest[0]);
    surfel.g = static_cast<uint8_t>(rest[1]);
    surfel.b = static_cast<uint8_t>(rest[2]);
    surfel.confidence = static_cast<uint8_t>(rest[3]);
    surfel.contributors = static_cast<uint8_t>(rest[4]);
    Tile& tile = tiles[key];
    tile.key = key;
    tile.surfels.push_back(surfel);
  }
  return tiles;
}

uint64_t hashOf(const std::map<TileKey, Tile>& tiles) {
  TileHash hash;
  for (const auto& [key, tile] : tiles) hash.add(tile);
  return hash.value();
}

// A frame of the agent's report: stamp, keyframe, state, then this.
Pose poseOf(const Json& frame) {
  const auto v = [&](size_t i) { return frame.at(i).get<double>(); };
  return Pose(Eigen::Quaterniond(v(9), v(6), v(7), v(8)), {v(3), v(4), v(5)});
}

using RobotApi = FlatTest;

TEST_F(RobotApi, AProgramThatFollowsSaysThatItsAgentWasKilled) {
  const std::string api = folder_.path("api.sock"), log = folder_.path("followed.txt");
  Background agent("edge_agent",
                   {"--domain", "97", "--core-site", "none-" + std::to_string(getpid()), "--robot", "robot-1",
                    "--source", "tum:" + flat_ + "/a", "--outbox", "memory", "--realtime", "--api-socket", api},
                   folder_.path("a.log"));
  for (int i = 0; i < 300 && access(api.c_str(), R_OK | W_OK) != 0; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  Background follow("../tests/comap_robot_follow", {api}, log);
  for (int i = 0; i < 300 && readFollowed(log).empty(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  ASSERT_FALSE(readFollowed(log).empty()) << contentOf(log) << contentOf(folder_.path("a.log"));
  agent.end(SIGKILL);
  EXPECT_EQ(follow.wait(), 3) << contentOf(log);
  EXPECT_NE(contentOf(log).find("it was killed"), std::string::npos) << contentOf(log);
}

TEST_F(RobotApi, ProgramsReadPosesAndSurfelsThatAgreeWithTheAgents) {
  const std::string site = "api-" + std::to_string(getpid()), api = folder_.path("api.sock");
  Background core("mapping_core", {"--domain", "97", "--core-site", site, "--store", folder_.path("m.comap")},
                  folder_.path("core.log"));
  Background agent("edge_agent",
                   {"--domain", "97", "--core-site", site, "--robot", "robot-1", "--source", "tum:" + flat_ + "/a",
                    "--outbox", "memory", "--realtime", "--api-socket", api, "--report", folder_.path("a.json")},
                   folder_.path("a.log"));
  for (int i = 0; i < 300 && access(api.c_str(), R_OK | W_OK) != 0; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  Background follow("../tests/comap_robot_follow", {api}, folder_.path("followed.txt"));
  // Until the agent ends; the last cloud is of the tiles it holds at the end, as these rest for two seconds before.
  const std::string last = folder_.path("last.ply"), next = folder_.path("next.ply");
  while (agent.runs()) {
    Background writes("../tests/comap_robot_surfels_to_ply", {api, next}, folder_.path("ply.log"));
    if (writes.wait() == 0) {
      ASSERT_EQ(rename(next.c_str(), last.c_str()), 0);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
  ASSERT_EQ(agent.wait(), 0) << contentOf(folder_.path("a.log"));
  EXPECT_EQ(follow.wait(), 0) << contentOf(folder_.path("followed.txt"));
  EXPECT_NE(access(api.c_str(), F_OK), 0);
  EXPECT_EQ(core.end(SIGTERM), 0);
  const Json report = Json::parse(contentOf(folder_.path("a.json")));

  const auto tiles = readTiles(last);
  EXPECT_GT(tiles.size(), 10u);
  EXPECT_LE(tiles.size(), report.at("tiles_held").get<size_t>()) << "which may hold no surfels, but places";
  EXPECT_EQ(hashOf(tiles), report.at("tiles_hash").get<uint64_t>()) << contentOf(folder_.path("ply.log"));

  const auto told = readFollowed(folder_.path("followed.txt"));
  ASSERT_FALSE(told.empty());
  std::map<int64_t, Pose> odometry;
  for (size_t i = 0; i < told.size(); ++i) {
    odometry[told[i].stamp_ns] = told[i].T_odom_cam;
    if (i > 0) {
      EXPECT_GT(told[i].sequence, told[i - 1].sequence);
      EXPECT_GE(told[i].stamp_ns, told[i - 1].stamp_ns);
    }
  }
  EXPECT_EQ(told.back().map, report.at("map").get<std::string>());
  EXPECT_EQ(told.back().map_state, 1);
  // The report has poses relative to keyframes, the programs were told them in the odometry's frame: those of one
  // keyframe differ by one motion.
  std::map<uint32_t, Pose> T_odom_keyframe;
  size_t compared = 0;
  for (const Json& frame : report.at("trajectory")) {
    const auto known = odometry.find(frame.at(0).get<int64_t>());
    if (known == odometry.end()) continue;
    const Pose T_odom_k = known->second * poseOf(frame).inverse();
    const auto [first, is_first] = T_odom_keyframe.emplace(frame.at(1).get<uint32_t>(), T_odom_k);
    if (is_first) continue;
    const Pose between = first->second.inverse() * T_odom_k;
    EXPECT_LT(between.translation().norm(), 1e-9) << frame;
    EXPECT_LT(between.angle(), 1e-6) << frame;
    ++compared;
  }
  EXPECT_GT(compared, report.at("frames").get<size_t>() / 2) << "the program saw most frames";
}

TEST_F(RobotApi, APathThatCannotBeASocketIsRefusedAtTheStart) {
  std::ofstream(folder_.path("file")) << "mine";
  const ProgramRun run = runProgram("edge_agent --robot a --offline --outbox " + folder_.path("outbox") +
                                    " --source tum:" + flat_ + "/a --api-socket " + folder_.path("file"));
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_NE(run.err.find("no socket"), std::string::npos) << run.err;
  EXPECT_EQ(contentOf(folder_.path("file")), "mine");
}

}  // namespace
}  // namespace comap
