// The whole circle: recorded robots in, one joint map out, and the map back on the robots.
#include <gtest/gtest.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "tests/end_to_end/program.h"
#include "tests/files/temporary_folder.h"

namespace comap {
namespace {

using Json = nlohmann::json;

std::string flatDir() {
  const char* dir = std::getenv("COMAP_FLAT_DIR");
  return dir != nullptr ? dir : "";
}

Json replay(const std::string& link, const std::string& robots, const std::string& out) {
  const ProgramRun run = runProgram("fleet replay --json --link " + link + " " + robots + " --out " + out);
  EXPECT_EQ(run.exit_code, 0) << run.err;
  return run.exit_code == 0 ? Json::parse(run.out) : Json();
}

Json evaluate(const std::string& run, const std::string& truths) {
  const ProgramRun done = runProgram("fleet evaluate " + run + " " + truths + " --json");
  EXPECT_EQ(done.exit_code, 0) << done.err;
  return done.exit_code == 0 ? Json::parse(done.out) : Json();
}

void expectOneMapOfAandB(const Json& report) {
  ASSERT_EQ(report.at("maps").size(), 1u) << report.dump(2);
  EXPECT_EQ(report.at("maps")[0].at("robots"), Json({"a", "b"}));
  EXPECT_GE(report.at("merges").size(), 1u);
  for (const auto& [name, robot] : report.at("robots").items()) {
    EXPECT_EQ(robot.at("keyframes_lost"), 0) << name;
    EXPECT_EQ(robot.at("tracking_lost_frames"), 0) << name;
    EXPECT_GT(robot.at("tiles_held").get<int>(), 20) << name;
    EXPECT_EQ(robot.at("map"), report.at("maps")[0].at("id")) << name;
  }
}

class Replay : public testing::TestWithParam<const char*> {};

TEST_P(Replay, TwoRobotsInAFlatBecomeOneMap) {
  if (flatDir().empty()) GTEST_SKIP() << "COMAP_FLAT_DIR names no synthetic flat; run by ctest, which makes one";
  const std::string flat = flatDir();
  const TemporaryFolder folder;
  const std::string run = folder.path("run");
  const Json report = replay(GetParam(), "--robot a=" + flat + "/a --robot b=" + flat + "/b", run);
  ASSERT_FALSE(report.is_null());
  expectOneMapOfAandB(report);
  for (const char* file : {"map.comap", "map.ply", "map.png", "report.json", "report.html", "a.trajectory.txt"})
    EXPECT_GT(std::filesystem::file_size(run + "/" + file), 100u) << file;

  const Json scores = evaluate(run, "--truth a=" + flat + "/a/groundtruth.txt --truth b=" + flat +
                                        "/b/groundtruth.txt --surface " + flat + "/surface.ply");
  ASSERT_FALSE(scores.is_null());
  EXPECT_LE(scores.at("joint_ate_rmse_m").get<double>(), 0.03);
  EXPECT_LE(scores.at("surface").at("accuracy_mean_m").get<double>(), 0.01);
}

TEST_P(Replay, TwoHalvesOfARecordedKitchenBecomeOneMap) {
  const char* data = std::getenv("COMAP_DATA_DIR");
  if (data == nullptr) GTEST_SKIP() << "COMAP_DATA_DIR is not set: no recorded sequences";
  const std::string kitchen = std::string(data) + "/kitchen_dev";
  const TemporaryFolder folder;
  const std::string run = folder.path("run");
  const Json report = replay(GetParam(), "--robot a=" + kitchen + "@0:200 --robot b=" + kitchen + "@200:400", run);
  ASSERT_FALSE(report.is_null());
  expectOneMapOfAandB(report);
  const Json scores =
      evaluate(run, "--truth a=" + kitchen + "/groundtruth.txt --truth b=" + kitchen + "/groundtruth.txt");
  ASSERT_FALSE(scores.is_null());
  EXPECT_LE(scores.at("joint_ate_rmse_m").get<double>(), 0.05);
}

INSTANTIATE_TEST_SUITE_P(Links, Replay, testing::Values("loopback", "dds"),
                         [](const auto& tested) { return std::string(tested.param); });

// The two rooms have their furniture in common, but not books, pictures and what lies about: single views match.
TEST(ReplayLoopback, LookAlikeRoomsStayTwoMaps) {
  const TemporaryFolder folder;
  const std::string twins = folder.path("twins");
  const ProgramRun made =
      runProgram("fleet synth --scene twins --robots 2 --frames 60 --seed 1 --noise kinect --out " + twins);
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const Json report = replay("loopback", "--robot a=" + twins + "/a --robot b=" + twins + "/b", folder.path("run"));
  ASSERT_FALSE(report.is_null());
  EXPECT_EQ(report.at("maps").size(), 2u) << report.at("maps").dump(2);
  EXPECT_TRUE(report.at("merges").empty());
  EXPECT_GT(report.at("verdicts").at("accepted").get<int>(), 1) << "views that match are what makes this hard";
  EXPECT_GT(report.at("verdicts").at("refused").value("contradiction", 0), 0);
}

TEST(ReplayLoopback, SameInputGivesTheSameBits) {
  if (flatDir().empty()) GTEST_SKIP() << "COMAP_FLAT_DIR names no synthetic flat; run by ctest, which makes one";
  const std::string flat = flatDir();
  const TemporaryFolder folder;
  const std::string robots = "--robot a=" + flat + "/a --robot b=" + flat + "/b";
  const Json first = replay("loopback", robots, folder.path("first"));
  const Json second = replay("loopback", robots, folder.path("second"));
  ASSERT_FALSE(first.is_null() || second.is_null());
  ASSERT_EQ(first.at("maps").size(), second.at("maps").size());
  for (size_t i = 0; i < first.at("maps").size(); ++i) {
    ASSERT_TRUE(first.at("maps")[i].at("hash").is_string());
    EXPECT_EQ(first.at("maps")[i].at("hash"), second.at("maps")[i].at("hash"));
  }
  for (const char* robot : {"a", "b"}) {
    const std::string trajectory = contentOf(folder.path("first") + "/" + robot + ".trajectory.txt");
    EXPECT_GT(trajectory.size(), 1000u);
    EXPECT_EQ(trajectory, contentOf(folder.path("second") + "/" + robot + ".trajectory.txt")) << robot;
  }
}

}  // namespace
}  // namespace comap
