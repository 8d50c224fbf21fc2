#include "protocol/telemetry/stage_clock.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

namespace comap {
namespace {

using std::chrono::milliseconds;

TEST(StageClock, CountsWhatRan) {
  StageClock clock;
  const auto t = std::chrono::steady_clock::now();
  for (int i = 1; i <= 10; ++i) clock.add("fuse", t, t + milliseconds(10 * i));
  { const StageSpan span("tiles", clock); }
  const auto times = clock.times();
  ASSERT_EQ(times.size(), 2u);
  EXPECT_EQ(times.at("fuse").count(), 10u);
  EXPECT_NEAR(times.at("fuse").sum_ms(), 550, 1e-9);
  EXPECT_DOUBLE_EQ(times.at("fuse").worst_ms(), 100);
  EXPECT_EQ(times.at("tiles").count(), 1u);
}

TEST(StageClock, TraceHoldsEachRunWithItsThread) {
  const auto path = std::filesystem::temp_directory_path() / ("comap-trace-" + std::to_string(getpid()) + ".json");
  StageClock clock;
  ASSERT_TRUE(clock.traceTo(path.string()));
  {
    const StageSpan outer("keyframe", clock);
    const StageSpan inner("fuse", clock);
  }
  std::thread([&] { const StageSpan span("read", clock); }).join();
  ASSERT_TRUE(clock.endTrace());
  std::ifstream file(path);
  const auto trace = nlohmann::json::parse(file);
  std::filesystem::remove(path);
  ASSERT_EQ(trace.size(), 3u);
  const auto& fuse = trace[0];  // ends first
  const auto& keyframe = trace[1];
  EXPECT_EQ(fuse.at("name"), "fuse");
  EXPECT_EQ(keyframe.at("name"), "keyframe");
  EXPECT_EQ(keyframe.at("ph"), "X");
  EXPECT_LE(keyframe.at("ts").get<int64_t>(), fuse.at("ts").get<int64_t>());
  EXPECT_GE(keyframe.at("ts").get<int64_t>() + keyframe.at("dur").get<int64_t>(),
            fuse.at("ts").get<int64_t>() + fuse.at("dur").get<int64_t>());
  EXPECT_EQ(fuse.at("tid"), keyframe.at("tid"));
  EXPECT_NE(trace[2].at("tid"), keyframe.at("tid"));
}

TEST(StageClock, ATraceThatCannotBeWrittenIsSaid) {
  StageClock clock;
  const auto refused = clock.traceTo("/no/such/folder/trace.json");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kUnreachable);
  ASSERT_TRUE(clock.traceTo("/dev/full"));
  for (int i = 0; i < 1000; ++i) const StageSpan span("fuse", clock);
  EXPECT_FALSE(clock.endTrace());
}

}  // namespace
}  // namespace comap
