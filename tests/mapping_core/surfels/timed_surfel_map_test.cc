// Active and inactive surfels of several cameras in one map.
#include "mapping_core/surfels/timed_surfel_map.h"

#include <gtest/gtest.h>

#include "mapping_core/surfels/surfel_pool.h"
#include "tests/mapping_core/gpu/test_device.h"
#include "tests/scenes/scene.h"

namespace comap {
namespace {

constexpr uint32_t kWindow = 5;

size_t shown(const TimedView& view) {
  size_t count = 0;
  for (size_t i = 0; i < view.view.depth_m.size(); ++i) count += view.view.depth_m.data()[i] > 0;
  return count;
}

FusionParameters parameters() {
  FusionParameters p;
  p.stable_confidence = 3;
  p.unstable_timeout = 4;
  return p;
}

struct Fixture {
  explicit Fixture(gpu::Device& device)
      : pool(*SurfelPool::create(device, 0, true)),
        map(pool, parameters()),
        frame(Scene::room().render(smallCamera(), Pose())) {}

  void fuse(uint32_t camera, uint32_t tick, const Pose& pose = {}) {
    const auto fused = map.fuse(frame.camera, frame.colour, frame.depth, pose, 100 * camera + tick,
                                {SeenBy::kActive, camera, tick, kWindow});
    ASSERT_TRUE(fused) << fused.error().text;
  }
  size_t shownTo(SeenBy which, uint32_t camera, uint32_t tick) {
    PredictionOptions options;
    options.min_confidence = parameters().stable_confidence;
    const auto view = map.predict(frame.camera, Pose(), options, {which, camera, tick, kWindow});
    return view ? shown(*view) : 0;
  }

  std::shared_ptr<SurfelPool> pool;
  TimedSurfelMap map;
  Frame frame;
};

TEST(TimedSurfelMap, EachCameraHasAnActivePartOfItsOwn) {
  COMAP_DEVICE_OR_SKIP(device);
  Fixture f(device);
  for (uint32_t tick = 1; tick <= 4; ++tick) f.fuse(0, tick);
  const size_t all = f.shownTo(SeenBy::kAny, 0, 4);
  ASSERT_GT(all, f.frame.depth.size() / 2);
  EXPECT_EQ(f.shownTo(SeenBy::kActive, 0, 4), all);
  EXPECT_EQ(f.shownTo(SeenBy::kInactive, 0, 4), 0u);
  EXPECT_EQ(f.shownTo(SeenBy::kActive, 1, 4), 0u) << "another camera has not seen it";
  EXPECT_EQ(f.shownTo(SeenBy::kInactive, 1, 4), all);
  EXPECT_EQ(f.shownTo(SeenBy::kActive, 0, 4 + kWindow + 1), 0u) << "long ago";
  EXPECT_EQ(f.shownTo(SeenBy::kInactive, 0, 4 + kWindow + 1), all);
}

TEST(TimedSurfelMap, AnotherCamerasSurfelsAreNotFusedWithButDoubled) {
  COMAP_DEVICE_OR_SKIP(device);
  Fixture f(device);
  for (uint32_t tick = 1; tick <= 4; ++tick) f.fuse(0, tick);
  const size_t before = f.map.size();
  f.fuse(1, 4);
  EXPECT_GT(f.map.size(), before + before / 2);
  f.fuse(1, 5);
  const auto surfels = f.map.download();
  ASSERT_TRUE(surfels);
  for (const TimedSurfel& one : *surfels) {
    const uint32_t maker = one.surfel.owner / 100;
    EXPECT_GT(one.seen[maker], 0);
    EXPECT_EQ(one.seen[1 - maker], 0);
  }
}

TEST(TimedSurfelMap, WhatNobodyConfirmsExpires) {
  COMAP_DEVICE_OR_SKIP(device);
  Fixture f(device);
  f.fuse(0, 1);
  const size_t once = f.map.size();
  const Frame wall = Scene::plainPlane({0, 0, 0.6}, {0, 0, -1}).render(smallCamera(), Pose());
  // A wall close before the camera says nothing about what is behind it.
  for (uint32_t tick = 2; tick <= 8; ++tick) {
    const auto fused =
        f.map.fuse(wall.camera, wall.colour, wall.depth, Pose(), tick, {SeenBy::kActive, 0, tick, kWindow});
    ASSERT_TRUE(fused);
  }
  const auto surfels = f.map.download();
  ASSERT_TRUE(surfels && once > 0);
  for (const TimedSurfel& one : *surfels) EXPECT_NE(one.surfel.owner, 1u);
}

TEST(TimedSurfelMap, RewritingNothingKeepsEveryBitAndAbsorbingKeepsAll) {
  COMAP_DEVICE_OR_SKIP(device);
  Fixture f(device);
  for (uint32_t tick = 1; tick <= 3; ++tick) f.fuse(0, tick);
  const auto before = f.map.download();
  ASSERT_TRUE(f.map.rewrite([](TimedSurfel&) {}));
  const auto after = f.map.download();
  ASSERT_TRUE(before && after);
  ASSERT_EQ(before->size(), after->size());
  for (size_t i = 0; i < before->size(); ++i) {
    EXPECT_EQ((*before)[i].surfel.position, (*after)[i].surfel.position);
    EXPECT_EQ((*before)[i].surfel.normal, (*after)[i].surfel.normal);
    EXPECT_EQ((*before)[i].seen, (*after)[i].seen);
  }
  TimedSurfelMap other(f.pool, parameters());
  other.absorb(std::move(f.map));
  EXPECT_EQ(other.size(), before->size());
}

}  // namespace
}  // namespace comap
