// What a run of the paper mode writes of its frames is what the comparison reads.
#include "fleet_tools/replay/frames_csv.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace comap {
namespace {

PaperFrameRecord recordOf(uint32_t tick, uint32_t camera, double track_ms, bool merged) {
  PaperFrameRecord record;
  record.tick = tick;
  record.camera = camera;
  record.ms = {.track = track_ms, .loop = 2, .fuse = 4, .predict = 8, .ferns = 16};
  record.inter_map_ms = 32;
  record.maps = 3;
  record.surfels = 70000;
  record.merged = merged;
  return record;
}

Result<RoundTimes> readBack(const std::string& text) {
  const std::string path =
      (std::filesystem::temp_directory_path() / ("comap_frames_" + std::to_string(getpid()))).string();
  std::ofstream(path) << text;
  auto times = readRoundTimes(path);
  std::filesystem::remove(path);
  return times;
}

TEST(FramesCsv, RoundsComeBackAsTheyWereWritten) {
  const std::vector<PaperFrameRecord> records = {recordOf(1, 0, 1, false), recordOf(1, 1, 1.25, false),
                                                 recordOf(2, 1, 100, true)};
  const auto times = readBack(framesCsv(records, {"a", "b"}));
  ASSERT_TRUE(times) << times.error().text;
  EXPECT_EQ(times->cameras, (std::vector<std::string>{"a", "b"}));
  ASSERT_EQ(times->ms.size(), 2u);
  EXPECT_EQ(times->ms[0], (std::vector<double>{63, 63.25}));
  EXPECT_EQ(times->ms[1], (std::vector<double>{0, 162})) << "a had no frame";
  EXPECT_EQ(times->merges, std::vector<size_t>{2}) << "as the file counts";
}

TEST(FramesCsv, EachCellStandsUnderItsName) {
  PaperFrameRecord record = recordOf(7, 0, 1, true);
  EXPECT_EQ(framesCsv({record}, {"a"}),
            "tick,camera,track_ms,loop_ms,fuse_ms,predict_ms,ferns_ms,inter_map_ms,total_ms,maps,surfels,local_loop,"
            "global_loop,merged,lost,loop_points,loop_nodes\n"
            "7,a,1.00,2.00,4.00,8.00,16.00,32.00,63.00,3,70000,0,0,1,0,0,0\n");
  record.merged = false;
  record.local_loop = record.lost = true;
  record.loop_points = 533;
  record.loop_nodes = 22;
  EXPECT_NE(framesCsv({record}, {"a"}).find(",70000,1,0,0,1,533,22\n"), std::string::npos);
}

TEST(FramesCsv, TicksBeyondTheLastAndMissingFilesAreRefused) {
  const auto late = readBack(framesCsv({recordOf(65536, 0, 1, false)}, {"a"}));
  ASSERT_FALSE(late);
  EXPECT_EQ(late.error().code, ErrorCode::kBadData);
  const auto missing = readRoundTimes("/nonexistent/frames.csv");
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::kUnreachable);
}

}  // namespace
}  // namespace comap
