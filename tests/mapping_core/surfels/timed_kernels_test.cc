// The kernels of timed maps against what they say they do, row by row and without slack: whole numbers decide.
#include "mapping_core/surfels/timed_kernels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "mapping_core/surfels/prediction.h"
#include "mapping_core/surfels/push_constants.h"
#include "mapping_core/surfels/surfel_kernels.h"
#include "tests/mapping_core/gpu/test_device.h"
#include "tests/reference/prediction_reference.h"

namespace comap {
namespace {

const CameraModel kCamera{65.6, 65.6, 39.5, 29.5, 80, 60};

// Surfels before the camera and behind it, sure, unsure and removed, that eight cameras saw at any time or never.
StreamRows someRows(size_t count) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> place(-2, 2);
  std::vector<Surfel> surfels(count);
  for (size_t i = 0; i < count; ++i) {
    surfels[i].position = {place(random), place(random), place(random) + 1};
    surfels[i].normal = -Eigen::Vector3f::UnitZ();
    surfels[i].radius = 0.03f;
    surfels[i].confidence = i % 5 == 0 ? -1.0f : static_cast<float>(random() % 20);
    surfels[i].owner = static_cast<uint32_t>(random() % 1000);
    surfels[i].contributors = 1u << random() % 8;
  }
  StreamRows rows = pack(surfels);
  rows.times.resize(count);
  for (SeenTimes& times : rows.times)
    for (uint16_t& tick : times) tick = random() % 3 == 0 ? 0 : static_cast<uint16_t>(1 + random() % 100);
  return rows;
}

class TimedKernelsTest : public testing::Test {
 protected:
  static constexpr uint32_t kRows = 3000;  // of them the last block is not full

  void SetUp() override {
    if (!testDevice()) GTEST_SKIP() << "no Vulkan device: " << testDeviceProblem();
    rows_ = someRows(kRows);
    auto streams = SurfelStreams::create(context(), 1 << 12, true);
    auto kernels = SurfelKernels::create(context());
    auto timed = TimedKernels::create(context());
    ASSERT_TRUE(streams && kernels && timed && writeRows(*streams, rows_, 0));
    streams_ = std::move(*streams);
    kernels_ = *kernels;
    timed_ = *timed;
  }

  gpu::Context& context() { return testDevice()->context(); }

  gpu::Buffer bufferOf(const std::vector<uint32_t>& words) {
    auto buffer = gpu::Buffer::create(context(), words.size() * 4, "words");
    EXPECT_TRUE(buffer && buffer->write(words.data(), words.size() * 4));
    return std::move(*buffer);
  }

  void dispatch(const gpu::Kernel& kernel, std::initializer_list<const gpu::Buffer*> buffers, const auto& push,
                size_t items) {
    auto recorder = gpu::Recorder::begin(context());
    ASSERT_TRUE(recorder);
    recorder->dispatch(kernel, buffers, push, gpu::groupsFor(items, kBlockItems));
    ASSERT_TRUE(recorder->submit());
  }

  StreamRows rows_;
  SurfelStreams streams_;
  SurfelKernels kernels_;
  TimedKernels timed_;
};

TEST_F(TimedKernelsTest, ExpireRemovesTheUnsureThatNobodyUpdatedForAWhile) {
  const gpu::Buffer counters = bufferOf({0, 0, 9, 5, 0, 0});
  constexpr uint32_t kTick = 90, kTimeout = 20;
  constexpr float kStable = 10;
  dispatch(*timed_.expire, {&streams_.places, &streams_.times, &counters},
           ExpirePush{kRows, 1, kTick, kTimeout, kStable}, kRows);
  const auto after = readRows(streams_, kRows);
  ASSERT_TRUE(after);
  uint32_t removed = 0;
  for (size_t i = 0; i < kRows; ++i) {
    const float confidence = rows_.places[i][3];
    const uint32_t latest = *std::max_element(rows_.times[i].begin(), rows_.times[i].end());
    const bool goes = confidence >= 0 && confidence < kStable && latest + kTimeout < kTick;
    removed += goes;
    EXPECT_EQ(after->places[i][3], goes ? -1.0f : confidence) << i;
  }
  EXPECT_GT(removed, 0u);
  EXPECT_EQ(*counters.read<uint32_t>(6), (std::vector<uint32_t>{0, 0, 9, 5 + removed, 0, 0}));
}

TEST_F(TimedKernelsTest, ListSeenListsTheActiveOnesOrAllOthersInView) {
  VisibleList list;
  ASSERT_TRUE(list.reserve(context(), 1 << 12));
  const ChunkRows chunk[] = {{&streams_, kRows}};
  constexpr uint32_t kCameraIndex = 3, kTick = 90, kWindow = 30;
  const FramePush frame = framePush(kCamera, Pose(), FusionParameters{});
  std::set<uint32_t> in_view[2], expected[2];
  for (const SeenBy which : {SeenBy::kActive, SeenBy::kInactive}) {
    const SeenStep step{{which, kCameraIndex, kTick, kWindow}, &timed_};
    auto recorder = gpu::Recorder::begin(context());
    ASSERT_TRUE(recorder);
    list.record(*recorder, kernels_, streams_, {{frame}, kRows, 2, 5, 3}, &step);
    ASSERT_TRUE(recorder->submit());
    noteBoxes(chunk);
    const auto words = list.list.read<uint32_t>(4 + 2 * kRows);
    ASSERT_TRUE(words);
    auto& found = in_view[which == SeenBy::kInactive];
    for (uint32_t i = 0; i < (*words)[3]; ++i) found.insert((*words)[4 + 2 * i]);
    EXPECT_EQ(found.size(), (*words)[3]) << "listed twice";
  }
  for (uint32_t i = 0; i < kRows; ++i) {
    const auto& place = rows_.places[i];
    const float u = place[0] / place[2] * 65.6f + 39.5f, v = place[1] / place[2] * 65.6f + 29.5f;
    if (place[3] < 2 || place[2] <= 0.05f || place[2] >= 5 || u <= -3 || v <= -3 || u >= 83 || v >= 63) continue;
    const uint32_t seen = rows_.times[i][kCameraIndex];
    const bool active = seen > 0 && seen <= kTick + 0 && kTick - seen <= kWindow;
    expected[!active].insert(i);
  }
  EXPECT_GT(expected[0].size(), 20u);
  EXPECT_GT(expected[1].size(), 20u);
  EXPECT_EQ(in_view[0], expected[0]);
  EXPECT_EQ(in_view[1], expected[1]);
}

TEST_F(TimedKernelsTest, StampFusedMarksTheWinnersOfTheirPixelsAlone) {
  constexpr uint32_t kBase = 500, kTick = 77, kCameraIndex = 5, kListed = 1500;
  // Each listed row has a pixel of its own; a third of them won it, a third fit without winning, the rest do not fit.
  std::vector<uint32_t> list{2, 1, 1, kListed}, winners(kListed, 0xffffffffu);
  for (uint32_t k = 0; k < kListed; ++k) {
    const uint32_t row = 2 * k, flags = k % 3 == 2 ? 1u : 3u;
    list.push_back(row);
    list.push_back(k << 3 | flags);
    if (k % 3 != 1) winners[k] = (k % 511) << 23 | (kBase + row);
    if (k % 3 == 1) winners[k] = 5u << 23 | (kBase + row + 1);
  }
  const gpu::Buffer listed = bufferOf(list), won = bufferOf(winners);
  dispatch(*timed_.stamp_fused, {&listed, &won, &streams_.times}, StampFusedPush{kBase, kCameraIndex, kTick}, kListed);
  const auto after = readRows(streams_, kRows);
  ASSERT_TRUE(after && after->times.size() == kRows);
  for (uint32_t i = 0; i < kRows; ++i) {
    SeenTimes expected = rows_.times[i];
    if (i % 2 == 0 && i / 2 < kListed && i / 2 % 3 == 0) expected[kCameraIndex] = kTick;
    EXPECT_EQ(after->times[i], expected) << i;
  }
}

TEST_F(TimedKernelsTest, StampNewGivesNewRowsTheirFirstTimesInEachChunkTheyWentTo) {
  constexpr uint32_t kCandidates = 1200, kInserted = 700, kTick = 66, kCameraIndex = 2, kCapacity = 1 << 12;
  const gpu::Buffer counters = bufferOf({1, 2, kInserted});
  const auto expectStamped = [&](uint32_t first, uint32_t end) {
    const auto after = readRows(streams_, kRows);
    ASSERT_TRUE(after);
    for (uint32_t i = 0; i < kRows; ++i) {
      SeenTimes expected = rows_.times[i];
      if (i >= first && i < end) expected = {}, expected[kCameraIndex] = kTick;
      ASSERT_EQ(after->times[i], expected) << i;
    }
  };
  // The first 400 went to the chunk before this one.
  dispatch(*timed_.stamp_new, {&counters, &streams_.times},
           StampNewPush{kCandidates, 2, 0u - 400u, kCapacity, kCameraIndex, kTick}, kCandidates);
  expectStamped(0, kInserted - 400);
  ASSERT_TRUE(writeRows(streams_, rows_, 0));
  // This one has room for 1000 rows, of which 800 are in use.
  dispatch(*timed_.stamp_new, {&counters, &streams_.times},
           StampNewPush{kCandidates, 2, 800, 1000, kCameraIndex, kTick}, kCandidates);
  expectStamped(800, 1000);
}

TEST_F(TimedKernelsTest, ResolveOwnerShowsWhatResolveShowsWithOwnersForContributors) {
  const FramePush frame = framePush(kCamera, Pose(), FusionParameters{});
  const ChunkRows chunk[] = {{&streams_, kRows}};
  PredictionBuffers buffers;
  const auto plain = predictView(context(), kernels_, chunk, buffers, frame, kCamera, {}, nullptr);
  const SeenStep all{{SeenBy::kAny, 0, 90, 30}, &timed_};
  const auto owners = predictView(context(), kernels_, chunk, buffers, frame, kCamera, {}, &all);
  ASSERT_TRUE(plain && owners);
  EXPECT_EQ(owners->depth_m, plain->depth_m);
  EXPECT_EQ(owners->normal, plain->normal);
  EXPECT_EQ(owners->colour, plain->colour);
  EXPECT_EQ(owners->confidence, plain->confidence);
  auto surfels = unpack(rows_);
  for (Surfel& surfel : surfels) surfel.contributors = surfel.owner;
  const PredictedView expected =
      reference::predict(reference::View(kCamera, Pose(), FusionParameters{}), surfels, PredictionOptions{});
  size_t shown = 0, differ = 0;
  for (size_t i = 0; i < expected.depth_m.size(); ++i) {
    if (expected.depth_m.data()[i] == 0) continue;
    ++shown;
    differ += owners->contributors.data()[i] != expected.contributors.data()[i];
  }
  EXPECT_GT(shown, 100u);
  EXPECT_LE(differ, shown / 50);
}

}  // namespace
}  // namespace comap
