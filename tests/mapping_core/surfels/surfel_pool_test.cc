// Maps of many chunks, and memory that does not hold them all.
#include "mapping_core/surfels/surfel_pool.h"

#include <gtest/gtest.h>

#include "mapping_core/surfels/view_bounds.h"
#include "tests/mapping_core/gpu/test_device.h"
#include "tests/scenes/scene.h"

namespace comap {
namespace {

const CameraModel kCamera{131.25, 131.25, 79.5, 59.5, 160, 120};
constexpr size_t kTwoChunks_bytes = 2 * kChunkSurfels * 56 + (1 << 20);

// A floor that is seen nowhere but where it is: 1000 surfels a metre of x.
std::vector<Surfel> longFloor(size_t count) {
  std::vector<Surfel> surfels(count);
  for (size_t i = 0; i < count; ++i) {
    Surfel& s = surfels[i];
    s.position = {static_cast<float>(i / 100) * 0.1f, 1.2f, 0.5f + static_cast<float>(i % 100) * 0.02f};
    s.normal = -Eigen::Vector3f::UnitY();
    s.radius = 0.07f;
    s.confidence = 2;
    s.observations = 2;
    s.owner = static_cast<uint32_t>(i % 3);
    s.colour = {static_cast<uint8_t>(i), static_cast<uint8_t>(i / 256), 7};
  }
  return surfels;
}

Pose above(double x) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(-0.7, Eigen::Vector3d::UnitX())), Eigen::Vector3d(x, 0, 0)};
}

TEST(SurfelPool, MapLargerThanItsMemoryIsWhole) {
  COMAP_DEVICE_OR_SKIP(device);
  const auto surfels = longFloor(3 * kChunkSurfels + 1000);
  const auto small = SurfelPool::create(device, kTwoChunks_bytes);
  const auto large = SurfelPool::create(device, 0);
  ASSERT_TRUE(small && large);
  SurfelMap away(*small, {}), here(*large, {});
  ASSERT_TRUE(away.append(surfels) && here.append(surfels));
  EXPECT_GE((*small)->chunksAway(), 2u);
  EXPECT_EQ((*large)->chunksAway(), 0u);
  EXPECT_LE((*small)->bytes(), kTwoChunks_bytes);
  EXPECT_EQ(away.size(), surfels.size());

  std::vector<Pose> motions(2);
  motions[1] = Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, 0.01));
  ASSERT_TRUE(away.moveOwners(motions) && here.moveOwners(motions));
  const auto before = away.changesSince(0), known = here.changesSince(0);
  ASSERT_TRUE(before && known);
  ASSERT_EQ(before->changed.size(), before->blocks.size());
  // At 524 m two chunks meet: they are all that fits, and new surfels go into another.
  for (const double x : {0.5, 1500.0, 524.0, 700.0, 10.0}) {
    const auto a = away.predict(kCamera, above(x), {}), b = here.predict(kCamera, above(x), {});
    ASSERT_TRUE(a) << a.error().text;
    ASSERT_TRUE(b);
    EXPECT_GT(a->depth_m.at(80, 60), 0.5f) << x;
    EXPECT_EQ(a->depth_m, b->depth_m) << x;
    EXPECT_EQ(a->colour, b->colour) << x;
    const DepthImage depth(160, 120, 6000);
    const auto fused = away.fuse(kCamera, ColourImage(160, 120), depth, above(x), 3, 1);
    const auto also = here.fuse(kCamera, ColourImage(160, 120), depth, above(x), 3, 1);
    ASSERT_TRUE(fused && also);
    EXPECT_GT(fused->inserted, 100u);
    EXPECT_EQ(fused->total, also->total);
  }
  const auto a = away.download(), b = here.download();
  ASSERT_TRUE(a && b);
  ASSERT_EQ(a->size(), b->size());
  // What was changed before it left is told like what is here.
  const auto changed = away.changesSince(before->moment), also = here.changesSince(known->moment);
  ASSERT_TRUE(changed && also);
  EXPECT_EQ(changed->blocks.size(), also->blocks.size());
  ASSERT_EQ(changed->changed.size(), also->changed.size());
  EXPECT_LT(changed->changed.size(), changed->blocks.size() / 4);
  for (size_t i = 0; i < also->changed.size(); ++i) {
    EXPECT_EQ(changed->changed[i].number, also->changed[i].number);
    EXPECT_EQ(changed->changed[i].surfels.size(), also->changed[i].surfels.size());
  }
  for (size_t i = 0; i < a->size(); ++i) {
    ASSERT_EQ((*a)[i].position, (*b)[i].position) << i;
    ASSERT_EQ((*a)[i].confidence, (*b)[i].confidence) << i;
    ASSERT_EQ((*a)[i].owner, (*b)[i].owner) << i;
  }
}

TEST(SurfelPool, WhatDoesNotFitAtOnceIsRefusedAndNothingIsLost) {
  COMAP_DEVICE_OR_SKIP(device);
  auto surfels = longFloor(3 * kChunkSurfels);
  for (Surfel& s : surfels) s.position.x() *= 0.0005f;  // all within one view
  const auto pool = SurfelPool::create(device, kTwoChunks_bytes);
  ASSERT_TRUE(pool);
  SurfelMap map(*pool, {});
  ASSERT_TRUE(map.append(surfels));
  const auto seen = map.predict(kCamera, above(0.3), {});
  ASSERT_FALSE(seen);
  EXPECT_EQ(seen.error().code, ErrorCode::kOutOfMemory);
  EXPECT_NE(seen.error().text.find("MiB"), std::string::npos) << seen.error().text;
  const auto all = map.download();
  ASSERT_TRUE(all);
  EXPECT_EQ(all->size(), surfels.size());
}

TEST(SurfelPool, AKeyframeWhoseNewSurfelsDoNotFitChangesNothing) {
  COMAP_DEVICE_OR_SKIP(device);
  // Room for one chunk of 4096 surfels.
  const auto pool = SurfelPool::create(device, (size_t{1} << 12) * 56 + 4096);
  ASSERT_TRUE(pool);
  FusionParameters parameters;
  parameters.initial_capacity = 1 << 12;
  SurfelMap map(*pool, parameters);
  const auto wall = [](int width, uint16_t value) {  // seen on the left side alone, or everywhere
    DepthImage depth(160, 120, 0);
    for (int y = 0; y < 120; ++y)
      for (int x = 0; x < width; ++x) depth.at(x, y) = value;
    return depth;
  };
  const auto fuse = [&](const DepthImage& depth, uint32_t owner) {
    return map.fuse(kCamera, ColourImage(160, 120), depth, Pose(), owner, 1);
  };
  ASSERT_TRUE(fuse(wall(100, 10000), 0));
  const auto before = map.download();
  // The same wall, which confirms every surfel, and, four times as near, another that needs more room than there is.
  DepthImage depth = wall(60, 10000);
  for (int y = 0; y < 120; ++y)
    for (int x = 64; x < 160; ++x) depth.at(x, y) = 2500;
  const auto refused = fuse(depth, 1);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kOutOfMemory);
  const auto after = map.download();
  ASSERT_TRUE(before && after);
  ASSERT_EQ(after->size(), before->size());
  for (size_t i = 0; i < before->size(); ++i) {
    ASSERT_EQ((*after)[i].confidence, (*before)[i].confidence) << i;
    ASSERT_EQ((*after)[i].observations, (*before)[i].observations) << i;
  }
  // And it takes the next one that fits.
  const auto taken = fuse(wall(60, 10000), 2);
  ASSERT_TRUE(taken) << taken.error().text;
  EXPECT_GT(taken->updated, 500u);
}

TEST(SurfelPool, MapsShareWhatOthersGiveBack) {
  COMAP_DEVICE_OR_SKIP(device);
  const auto pool = SurfelPool::create(device, 0);
  ASSERT_TRUE(pool);
  const Frame frame = Scene::room().render(kCamera, Pose());
  FusionParameters parameters;
  parameters.initial_capacity = 1 << 14;
  size_t bytes = 0;
  for (int i = 0; i < 5; ++i) {
    SurfelMap one(*pool, parameters), two(*pool, parameters);
    ASSERT_TRUE(one.fuse(kCamera, frame.colour, frame.depth, Pose(), 0, 1));
    ASSERT_TRUE(two.fuse(kCamera, frame.colour, frame.depth, Pose(), 0, 1));
    const auto a = one.download(), b = two.download();
    ASSERT_TRUE(a && b);
    EXPECT_EQ(a->size(), b->size());
    if (i == 0) bytes = (*pool)->bytes();
    EXPECT_EQ((*pool)->bytes(), bytes);
  }
  EXPECT_EQ(bytes, 2 * (size_t{1} << 14) * 56);
}

TEST(SurfelPool, WhatDoesNotMoveStaysAway) {
  COMAP_DEVICE_OR_SKIP(device);
  auto surfels = longFloor(3 * kChunkSurfels);
  for (size_t i = 0; i < surfels.size(); ++i) surfels[i].owner = static_cast<uint32_t>(i / (kChunkSurfels / 2));
  const auto pool = SurfelPool::create(device, kTwoChunks_bytes);
  ASSERT_TRUE(pool);
  SurfelMap map(*pool, {});
  ASSERT_TRUE(map.append(surfels));
  const auto before = map.download();
  std::vector<Pose> motions(6, Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(1e-12, 0, 0)));
  ASSERT_TRUE(map.predict(kCamera, above(1500), {}));  // the last is here
  for (const uint32_t owner : {5u, 0u}) {
    motions[owner] = Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 1, 0));
    const size_t away = (*pool)->chunksAway();
    ASSERT_TRUE(map.moveOwners(motions));
    EXPECT_EQ((*pool)->chunksAway(), away);
    motions[owner] = Pose();
  }
  const auto after = map.download();
  ASSERT_TRUE(before && after);
  for (size_t i = 0; i < surfels.size(); i += 1000) {
    const uint32_t owner = surfels[i].owner;
    const Eigen::Vector3f moved = (*after)[i].position - (*before)[i].position;
    ASSERT_FLOAT_EQ(moved.y(), owner == 0 || owner == 5 ? 1.0f : 0.0f) << i;
  }
}

TEST(ChunkBounds, WhatLiesBetweenTwoPlacesIsInNeither) {
  const auto frameAt = [](double x) { return framePush(kCamera, Pose(Eigen::Quaterniond::Identity(), {x, 0, 0}), {}); };
  const auto boxAt = [](float x) {
    return Eigen::AlignedBox3f(Eigen::Vector3f(x - 1, -1, 2), Eigen::Vector3f(x + 1, 1, 4));
  };
  ChunkBounds bounds;
  EXPECT_FALSE(bounds.mayBeInView(frameAt(0), 5, 1));
  for (int i = 0; i < 50; ++i) {
    bounds.extend(boxAt(0.02f * static_cast<float>(i)));
    bounds.extend(boxAt(100 + 0.02f * static_cast<float>(i)));
  }
  EXPECT_EQ(bounds.parts(), 2u);
  EXPECT_TRUE(bounds.mayBeInView(frameAt(0), 5, 1));
  EXPECT_TRUE(bounds.mayBeInView(frameAt(101), 5, 1));
  EXPECT_FALSE(bounds.mayBeInView(frameAt(50), 5, 1));
  ChunkBounds joined;
  joined.extend({{0, 0, 3, 1}, {50, 0, 3, -1}, {0.1f, 0, 3, 2}});  // the second is a gap
  EXPECT_FALSE(joined.mayBeInView(frameAt(50), 5, 1));
  joined.extend(bounds);
  EXPECT_TRUE(joined.mayBeInView(frameAt(0), 5, 1));
  EXPECT_TRUE(joined.mayBeInView(frameAt(100), 5, 1));
  EXPECT_FALSE(joined.mayBeInView(frameAt(50), 5, 1));
}

TEST(ViewBounds, BoxesAroundTheCameraAreInViewOnlyWhereItLooks) {
  const FramePush frame = framePush(kCamera, Pose(), {});
  const auto box = [](float x, float y, float z) {
    const Eigen::Vector3f centre(x, y, z);
    return Eigen::AlignedBox3f(centre.array() - 0.5f, centre.array() + 0.5f);
  };
  EXPECT_TRUE(mayBeInView(box(0, 0, 2), frame, 5, 1));
  EXPECT_TRUE(mayBeInView(box(0, 0, 0), frame, 5, 1));  // the camera is in it
  EXPECT_TRUE(
      mayBeInView(Eigen::AlignedBox3f(Eigen::Vector3f::Constant(-9), Eigen::Vector3f::Constant(9)), frame, 5, 1));
  EXPECT_FALSE(mayBeInView(box(0, 0, -2), frame, 5, 1));
  EXPECT_FALSE(mayBeInView(box(0, 0, 7), frame, 5, 1));
  EXPECT_FALSE(mayBeInView(box(3, 0, 2), frame, 5, 1));
  EXPECT_FALSE(mayBeInView(box(0, -3, 2), frame, 5, 1));
  const Eigen::AlignedBox3f view = viewBounds(frame, 5);
  EXPECT_NEAR(view.max().z(), 5, 1e-5);
  EXPECT_NEAR(view.min().z(), 0, 1e-5);
  EXPECT_NEAR(view.max().x(), 5 * 80 / 131.25, 1e-4);
  EXPECT_NEAR(view.min().y(), -5 * 60 / 131.25, 1e-4);
}

}  // namespace
}  // namespace comap
