// Boxes of blocks, the list of those in view and what goes on between groups of a prediction, each kernel by itself
// against its scalar reference. What is not at the very border of a view is decided without slack.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <set>

#include "mapping_core/gpu/recorder.h"
#include "mapping_core/surfels/push_constants.h"
#include "mapping_core/surfels/surfel_kernels.h"
#include "mapping_core/surfels/surfel_streams.h"
#include "tests/mapping_core/gpu/test_device.h"

namespace comap {
namespace {

using Box = std::array<std::array<float, 4>, 2>;  // lowest and highest corner

class BlockKernelsTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!testDevice()) GTEST_SKIP() << "no Vulkan device: " << testDeviceProblem();
    auto kernels = SurfelKernels::create(context());
    ASSERT_TRUE(kernels) << kernels.error().text;
    kernels_ = *kernels;
  }

  gpu::Context& context() { return testDevice()->context(); }

  template <class Item>
  gpu::Buffer bufferOf(const std::vector<Item>& items) {
    auto buffer = gpu::Buffer::create(context(), items.size() * sizeof(Item), "items");
    EXPECT_TRUE(buffer && buffer->write(items.data(), items.size() * sizeof(Item)));
    return std::move(*buffer);
  }

  void dispatch(const gpu::Kernel& kernel, std::initializer_list<const gpu::Buffer*> buffers, const auto& push,
                uint32_t groups) {
    auto recorder = gpu::Recorder::begin(context());
    ASSERT_TRUE(recorder);
    recorder->dispatch(kernel, buffers, push, groups);
    ASSERT_TRUE(recorder->submit());
  }

  SurfelKernels kernels_;
};

TEST_F(BlockKernelsTest, BoundBlocksIsTheBoxOfTheRowsThatAreThere) {
  constexpr uint32_t kBlocks = 5, kFirst = 1, kRows = (kBlocks - 1) * kBlockItems + 37;  // the last one is not full
  std::mt19937 random(3);
  std::normal_distribution<float> place(0, 3);
  std::vector<std::array<float, 4>> places(kBlocks * kBlockItems);
  for (size_t i = 0; i < places.size(); ++i) {
    const bool empty = i / kBlockItems == 2;  // a block of which all are removed
    places[i] = {place(random), place(random), place(random), empty || i % 7 == 0 ? -1.0f : 5.0f};
  }
  for (size_t i = kRows; i < places.size(); ++i)
    places[i] = {99, 99, 99, 5};  // what lies behind the rows does not count
  const Box untouched{{{1, 2, 3, 4}, {5, 6, 7, 8}}};
  const gpu::Buffer boxes = bufferOf(std::vector<Box>(kBlocks, untouched));
  const gpu::Buffer rows = bufferOf(places);
  dispatch(*kernels_.bound_blocks, {&rows, &boxes}, BoundBlocksPush{kFirst, kRows}, kBlocks - kFirst);
  const auto found = boxes.read<Box>(kBlocks);
  ASSERT_TRUE(found);
  EXPECT_EQ((*found)[0], untouched);
  for (uint32_t block = kFirst; block < kBlocks; ++block) {
    Box expected{{{1e30f, 1e30f, 1e30f, 0}, {-1e30f, -1e30f, -1e30f, 0}}};
    for (size_t i = block * kBlockItems; i < std::min<size_t>(kRows, (block + 1) * kBlockItems); ++i) {
      if (places[i][3] < 0) continue;
      for (size_t axis = 0; axis < 3; ++axis) {
        expected[0][axis] = std::min(expected[0][axis], places[i][axis]);
        expected[1][axis] = std::max(expected[1][axis], places[i][axis]);
      }
    }
    EXPECT_EQ((*found)[block], expected) << "block " << block;
  }
}

// By how much a box, grown by 0.1 m, reaches into the view, in metres across the nearest of its six planes; negative if
// it lies beyond one. A box whose lowest corner is above its highest has no surfels.
double reachIntoView(const Box& box, const CameraModel& camera, const Pose& T_map_cam, double farthest_m,
                     double margin_px) {
  if (box[0][0] > box[1][0]) return -1;
  std::vector<Eigen::Vector3d> corners;
  for (int k = 0; k < 8; ++k) {
    Eigen::Vector3d corner;
    for (int axis = 0; axis < 3; ++axis) {
      const bool high = ((k >> axis) & 1) != 0;
      corner[axis] = box[high ? 1 : 0][static_cast<size_t>(axis)] + (high ? 0.1 : -0.1);
    }
    corners.push_back(T_map_cam.inverse() * corner);
  }
  const auto slope = [&](double pixel, double focal, double centre) { return (pixel - centre) / focal; };
  const double x0 = slope(-margin_px, camera.fx, camera.cx), x1 = slope(camera.width + margin_px, camera.fx, camera.cx);
  const double y0 = slope(-margin_px, camera.fy, camera.cy),
               y1 = slope(camera.height + margin_px, camera.fy, camera.cy);
  const std::pair<Eigen::Vector3d, double> planes[] = {
      {{0, 0, 1}, 0},
      {{0, 0, -1}, farthest_m},
      {{1, 0, -std::min(x0, x1)}, 0},
      {{-1, 0, std::max(x0, x1)}, 0},
      {{0, 1, -std::min(y0, y1)}, 0},
      {{0, -1, std::max(y0, y1)}, 0},
  };
  double least = std::numeric_limits<double>::max();
  for (const auto& [normal, offset] : planes) {
    double most = -std::numeric_limits<double>::max();
    for (const Eigen::Vector3d& corner : corners) most = std::max(most, normal.dot(corner) + offset);
    least = std::min(least, most);
  }
  return least;
}

TEST_F(BlockKernelsTest, ListBlocksListsThoseThatReachIntoTheView) {
  constexpr uint32_t kBlocks = 1500;
  constexpr float kFarthest = 5, kMargin = 3;
  std::mt19937 random(7);
  std::uniform_real_distribution<float> place(-6, 6), size(0, 0.6f);
  std::vector<Box> boxes(kBlocks);
  for (uint32_t i = 0; i < kBlocks; ++i) {
    for (size_t axis = 0; axis < 3; ++axis) {
      boxes[i][0][axis] = place(random);
      boxes[i][1][axis] = boxes[i][0][axis] + size(random);
    }
    if (i % 50 == 0) boxes[i] = {{{1e30f, 1e30f, 1e30f, 0}, {-1e30f, -1e30f, -1e30f, 0}}};
  }
  const gpu::Buffer on_device = bufferOf(boxes);
  for (int view = 0; view < 8; ++view) {
    SCOPED_TRACE(view);
    CameraModel camera{131.25, 131.25, 79.5, 59.5, 160, 120};
    if (view % 2 == 1) camera.fy = -camera.fy;  // y up
    const Pose T_map_cam(
        Eigen::Quaterniond(Eigen::AngleAxisd(0.8 * view, Eigen::Vector3d(0.3, 1, 0.1 * view).normalized())),
        Eigen::Vector3d(0.2 * view, -0.1, 0.3));
    const gpu::Buffer list = bufferOf(std::vector<uint32_t>(4 + kBlocks, 0));
    dispatch(*kernels_.list_blocks, {&on_device, &list},
             ListBlocksPush{{framePush(camera, T_map_cam, FusionParameters{})}, kBlocks, kFarthest, kMargin},
             gpu::groupsFor(kBlocks, kBlockItems));
    const auto words = list.read<uint32_t>(4 + kBlocks);
    ASSERT_TRUE(words);
    EXPECT_EQ((*words)[1], 1u);
    EXPECT_EQ((*words)[2], 1u);
    const std::set<uint32_t> listed(words->begin() + 4, words->begin() + 4 + (*words)[0]);
    EXPECT_EQ(listed.size(), (*words)[0]) << "listed twice";
    size_t in_view = 0;
    for (uint32_t i = 0; i < kBlocks; ++i) {
      const double reach = reachIntoView(boxes[i], camera, T_map_cam, kFarthest, kMargin);
      if (std::abs(reach) < 1e-4) continue;
      in_view += reach > 0;
      EXPECT_EQ(listed.contains(i), reach > 0) << "block " << i << " reaches " << reach << " m into the view";
    }
    EXPECT_GT(in_view, 20u);
    EXPECT_LT(in_view, kBlocks / 2);
  }
}

TEST_F(BlockKernelsTest, CarryRanksKeepsRanksAndForgetsWho) {
  constexpr uint32_t kNobody = 0xffffffffu, kSurfelMask = (1u << 23) - 1;
  std::mt19937 random(9);
  std::vector<uint32_t> keys(5000);
  for (size_t i = 0; i < keys.size(); ++i) {
    const uint32_t rank = 1 + static_cast<uint32_t>(random() % 511);
    keys[i] = i % 3 == 0 ? kNobody : rank << 23 | static_cast<uint32_t>(random() % kSurfelMask);
  }
  std::vector<uint32_t> expected = keys;
  for (size_t i = 0; i < keys.size(); ++i)
    if (keys[i] != kNobody) expected[i] = ((keys[i] >> 23) - 1) << 23 | kSurfelMask;
  const gpu::Buffer buffer = bufferOf(keys);
  const auto carry = [&] {
    dispatch(*kernels_.carry_ranks, {&buffer}, CarryRanksPush{static_cast<uint32_t>(keys.size())},
             gpu::groupsFor(keys.size(), kBlockItems));
    return *buffer.read<uint32_t>(keys.size());
  };
  EXPECT_EQ(carry(), expected);
  EXPECT_EQ(carry(), expected) << "what an earlier group left stays as it is";
  // A surfel of the next group is shown if its rank is less, and only then.
  for (size_t i = 0; i < keys.size(); ++i) {
    if (keys[i] == kNobody) continue;
    const uint32_t rank = keys[i] >> 23;
    EXPECT_LT(expected[i], rank << 23) << "the older of two of one rank stays";
    EXPECT_GE(expected[i], (rank - 1) << 23 | (kSurfelMask - 1)) << "whoever is nearer takes its place";
  }
}

}  // namespace
}  // namespace comap
