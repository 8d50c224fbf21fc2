#include "edge_agent/agent_report.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/files/temporary_folder.h"

namespace comap {
namespace {

namespace fs = std::filesystem;

class AgentReportTest : public testing::Test {
 protected:
  std::string path() const { return folder_.path("a.report.json"); }

  const TemporaryFolder folder_;
};

FrameRecord frameAt(int i) {
  FrameRecord frame;
  frame.stamp_ns = 1305031102175304000 + i;
  frame.keyframe = static_cast<uint32_t>(i / 10);
  frame.T_keyframe_cam = Pose(Eigen::Quaterniond(Eigen::AngleAxisd(0.01 * i, Eigen::Vector3d::UnitY())),
                              Eigen::Vector3d(0.1 * i, -1, 1.0 / 3));
  frame.state = i % 7 == 0 ? TrackingState::kPoor : TrackingState::kOk;
  return frame;
}

AgentReport numbers() {
  AgentReport report;
  report.robot = std::string("a");
  report.session = 1ull << 60 | 5;
  report.frames = 100;
  report.keyframes = 10;
  report.lost_frames = 2;
  report.map = std::string("a-1-0");
  report.odometry_ms_median = 6.5;
  report.odometry_ms_worst = 31.25;
  report.duration_s = 3.3;
  return report;
}

TEST_F(AgentReportTest, FramesWrittenAsTheyCameAreReadBackExactly) {
  auto file = AgentReportFile::create(path());
  ASSERT_TRUE(file) << file.error().text;
  for (int i = 0; i < 98; ++i) file->add(frameAt(i));
  EXPECT_FALSE(fs::exists(path()));  // not whole yet
  ASSERT_TRUE(file->finish(numbers()));
  const auto read = readAgentReport(path());
  ASSERT_TRUE(read) << read.error().text;
  EXPECT_EQ(read->robot, "a");
  EXPECT_EQ(read->session, 1ull << 60 | 5);
  EXPECT_EQ(read->map, "a-1-0");
  EXPECT_EQ(read->lost_frames, 2u);
  EXPECT_EQ(read->odometry_ms_worst, 31.25);
  ASSERT_EQ(read->trajectory.size(), 98u);
  for (int i = 0; i < 98; ++i) {
    const FrameRecord expected = frameAt(i), &found = read->trajectory[static_cast<size_t>(i)];
    EXPECT_EQ(found.stamp_ns, expected.stamp_ns);
    EXPECT_EQ(found.keyframe, expected.keyframe);
    EXPECT_EQ(found.state, expected.state);
    EXPECT_LT((found.T_keyframe_cam.inverse() * expected.T_keyframe_cam).translation().norm(), 1e-12);
    EXPECT_LT((found.T_keyframe_cam.inverse() * expected.T_keyframe_cam).angle(), 1e-7);
  }
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_.path()), {}), 1);  // nothing else is left
}

TEST_F(AgentReportTest, ARunWithoutFramesIsAReportToo) {
  auto file = AgentReportFile::create(path());
  ASSERT_TRUE(file);
  ASSERT_TRUE(file->finish(numbers()));
  const auto read = readAgentReport(path());
  ASSERT_TRUE(read) << read.error().text;
  EXPECT_TRUE(read->trajectory.empty());
}

TEST_F(AgentReportTest, AnUnfinishedReportLeavesWhatWasThere) {
  std::ofstream(path()) << "old";
  {
    auto file = AgentReportFile::create(path());
    ASSERT_TRUE(file);
    file->add(frameAt(0));
  }
  std::string text;
  std::getline(std::ifstream(path()) >> std::ws, text);
  EXPECT_EQ(text, "old");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_.path()), {}), 1);
}

TEST_F(AgentReportTest, AFullDiskIsToldAtTheEnd) {
  fs::create_symlink("/dev/full", path() + ".part");
  auto file = AgentReportFile::create(path());
  ASSERT_TRUE(file);
  for (int i = 0; i < 5000; ++i) file->add(frameAt(i));
  const auto finished = file->finish(numbers());
  ASSERT_FALSE(finished);
  EXPECT_EQ(finished.error().code, ErrorCode::kUnreachable);
  EXPECT_NE(finished.error().text.find(path()), std::string::npos);
  EXPECT_NE(finished.error().text.find("No space left"), std::string::npos) << finished.error().text;
  EXPECT_FALSE(fs::exists(path()));
}

TEST_F(AgentReportTest, PlacesThatCannotBeWrittenAreRefused) {
  for (const std::string& place : {std::string("/nonexistent/x.json"), std::string("/dev/null"), folder_.path()}) {
    const auto file = AgentReportFile::create(place);
    ASSERT_FALSE(file) << place;
    EXPECT_EQ(file.error().code, ErrorCode::kUnreachable);
    EXPECT_NE(file.error().text.find(place), std::string::npos);
  }
}

TEST_F(AgentReportTest, ACutOffFileIsRefusedByName) {
  std::ofstream(path()) << "{\"trajectory\":[\n[1,2,0";
  const auto read = readAgentReport(path());
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, ErrorCode::kBadData);
  EXPECT_NE(read.error().text.find(path()), std::string::npos);
}

}  // namespace
}  // namespace comap
