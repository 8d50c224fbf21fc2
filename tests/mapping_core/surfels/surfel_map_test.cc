// The map's contract: determinism, order, growth, moving, and refusals.
#include "mapping_core/surfels/surfel_map.h"

#include <gtest/gtest.h>

#include <limits>
#include <map>

#include "mapping_core/surfels/compaction.h"
#include "mapping_core/surfels/surfel_pool.h"
#include "tests/mapping_core/gpu/test_device.h"
#include "tests/scenes/scene.h"

namespace comap {
namespace {

const CameraModel kCamera{131.25, 131.25, 79.5, 59.5, 160, 120};

Pose viewPose(int i) {
  return Pose(Eigen::Quaterniond(Eigen::AngleAxisd(0.06 * i, Eigen::Vector3d::UnitY())),
              Eigen::Vector3d(0.05 * i, 0, 0.02 * i));
}

void fuseRoom(SurfelMap& map, int keyframes) {
  const Scene scene = Scene::room();
  for (int k = 0; k < keyframes; ++k) {
    const Frame frame = scene.render(kCamera, viewPose(k));
    const auto report =
        map.fuse(kCamera, frame.colour, frame.depth, viewPose(k), static_cast<uint32_t>(k), 1u << k % 3);
    ASSERT_TRUE(report) << report.error().text;
    ASSERT_EQ(report->total, map.size());
  }
}

bool identical(const Surfel& a, const Surfel& b) {
  return a.position == b.position && a.normal == b.normal && a.radius == b.radius && a.confidence == b.confidence &&
         a.colour == b.colour && a.owner == b.owner && a.contributors == b.contributors &&
         a.observations == b.observations;
}

bool identical(const std::vector<Surfel>& a, const std::vector<Surfel>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const Surfel& x, const Surfel& y) { return identical(x, y); });
}

std::vector<Surfel> someSurfels(size_t count) {
  std::vector<Surfel> surfels(count);
  for (size_t i = 0; i < count; ++i) {
    Surfel& s = surfels[i];
    const auto x = static_cast<float>(i);
    s.position = {x * 0.01f, -x, 2 + x * 0.001f};
    s.normal = Eigen::Vector3f(0.1f, x * 0.001f, -1).normalized();
    s.radius = 0.004f + x * 1e-6f;
    s.confidence = 1 + x * 0.25f;
    s.colour = {static_cast<uint8_t>(i), static_cast<uint8_t>(255 - i % 256), static_cast<uint8_t>(i / 7)};
    s.owner = static_cast<uint32_t>(i % 5);
    s.contributors = 0x80000001u;
    s.observations = static_cast<uint32_t>(i % 70000);
  }
  return surfels;
}

SurfelMap mapOn(gpu::Device& device, uint32_t capacity = 1 << 16) {
  FusionParameters parameters;
  parameters.initial_capacity = capacity;
  auto map = SurfelMap::create(device, parameters);
  EXPECT_TRUE(map) << map.error().text;
  return std::move(*map);
}

TEST(SurfelMap, SameKeyframesGiveSameBits) {
  COMAP_DEVICE_OR_SKIP(device);
  SurfelMap one = mapOn(device), two = mapOn(device);
  fuseRoom(one, 6);
  fuseRoom(two, 6);
  const auto a = one.download(), b = two.download();
  ASSERT_TRUE(a && b);
  ASSERT_GT(a->size(), 3000u);
  EXPECT_TRUE(identical(*a, *b));
  const auto seen_a = one.predict(kCamera, viewPose(3), {}), seen_b = two.predict(kCamera, viewPose(3), {});
  ASSERT_TRUE(seen_a && seen_b);
  EXPECT_EQ(seen_a->depth_m, seen_b->depth_m);
  EXPECT_EQ(seen_a->colour, seen_b->colour);
}

TEST(SurfelMap, StagedDeviceAndSmallCapacityGiveSameBits) {
  COMAP_DEVICE_OR_SKIP(device);
  gpu::DeviceOptions options;
  options.choice = std::to_string(device.info().index);
  options.validation = true;
  options.force_staging = true;
  auto staged = gpu::Device::create(options);
  ASSERT_TRUE(staged) << staged.error().text;
  {
    SurfelMap one = mapOn(device), two = mapOn(*staged, 1);
    fuseRoom(one, 4);
    fuseRoom(two, 4);
    const auto a = one.download(), b = two.download();
    ASSERT_TRUE(a && b);
    EXPECT_TRUE(identical(*a, *b));
    const auto seen = two.predict(kCamera, viewPose(1), {});
    ASSERT_TRUE(seen);
    EXPECT_EQ(seen->depth_m, one.predict(kCamera, viewPose(1), {})->depth_m);
  }
  EXPECT_EQ(validationText(*staged), "");
}

TEST(SurfelMap, OwnersContributorsAndCountsAreKept) {
  COMAP_DEVICE_OR_SKIP(device);
  SurfelMap map = mapOn(device);
  const Frame frame = Scene::room().render(kCamera, Pose());
  ASSERT_TRUE(map.fuse(kCamera, frame.colour, frame.depth, Pose(), 7, 1));
  const auto report = map.fuse(kCamera, frame.colour, frame.depth, Pose(), 8, 4);
  ASSERT_TRUE(report);
  EXPECT_LT(report->inserted, report->total / 20);
  const auto surfels = map.download();
  ASSERT_TRUE(surfels);
  size_t both = 0;
  for (const Surfel& s : *surfels) {
    if (s.owner != 7 || s.observations != 2) continue;
    ++both;
    EXPECT_EQ(s.contributors, 5u);
  }
  EXPECT_GT(both, surfels->size() * 9 / 10);
}

// Follows a map by what it says has changed.
class Follower {
 public:
  // Blocks that were told to have changed.
  size_t follow(SurfelMap& map) {
    const auto changes = map.changesSince(moment_);
    EXPECT_TRUE(changes) << changes.error().text;
    moment_ = changes->moment;
    for (const SurfelBlock& block : changes->changed) blocks_[block.number] = block.surfels;
    std::vector<Surfel> all;
    for (const uint64_t number : changes->blocks) {
      EXPECT_TRUE(blocks_.contains(number));
      all.insert(all.end(), blocks_[number].begin(), blocks_[number].end());
    }
    EXPECT_TRUE(identical(all, *map.download()));
    return changes->changed.size();
  }
  size_t known() const { return blocks_.size(); }

 private:
  uint64_t moment_ = 0;
  std::map<uint64_t, std::vector<Surfel>> blocks_;
};

TEST(SurfelMap, WhoReadsOnlyWhatHasChangedHasTheMap) {
  COMAP_DEVICE_OR_SKIP(device);
  SurfelMap map = mapOn(device, 1);
  Follower follower, late;
  double fewest = 1;
  EXPECT_EQ(follower.follow(map), 0u);
  const Scene scene = Scene::room();
  for (int k = 0; k < 24; ++k) {
    const Pose T_map_cam = viewPose(4 * k);  // turns around: what was seen first is out of view, then seen again
    const Frame frame = scene.render(kCamera, T_map_cam);
    ASSERT_TRUE(map.fuse(kCamera, frame.colour, frame.depth, T_map_cam, static_cast<uint32_t>(k), 1));
    const size_t changed = follower.follow(map);
    EXPECT_GT(changed, 0u);
    EXPECT_LE(changed, follower.known());
    fewest = std::min(fewest, static_cast<double>(changed) / static_cast<double>(follower.known()));
    EXPECT_EQ(follower.follow(map), 0u);
  }
  EXPECT_LT(fewest, 0.5) << "most of the map was out of view";
  std::vector<Pose> motions(4, Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0.1, 0)));
  ASSERT_TRUE(map.moveOwners(motions));
  EXPECT_GT(follower.follow(map), 0u);
  ASSERT_TRUE(map.append(someSurfels(3000)));
  EXPECT_GE(follower.follow(map), 3u);
  EXPECT_GT(late.follow(map), 10u);
  map.clear();
  EXPECT_EQ(follower.follow(map), 0u);
  ASSERT_TRUE(map.append(someSurfels(500)));
  EXPECT_EQ(follower.follow(map), 1u);
  EXPECT_EQ(late.follow(map), 1u);
}

// Depth that comes nearer and goes again removes what was behind and what was in front: gaps, that are closed.
TEST(SurfelMap, WhatIsRemovedAndMovedUpIsTold) {
  COMAP_DEVICE_OR_SKIP(device);
  SurfelMap map = mapOn(device, 1);
  Follower follower;
  size_t removed = 0;
  for (uint32_t k = 0; k < 40; ++k) {
    const DepthImage depth(kCamera.width, kCamera.height, static_cast<uint16_t>(k / 10 % 2 == 0 ? 8000 : 10000));
    const auto report = map.fuse(kCamera, ColourImage(kCamera.width, kCamera.height), depth, viewPose(0), k, 1);
    ASSERT_TRUE(report) << report.error().text;
    removed += report->removed;
    follower.follow(map);
  }
  EXPECT_GT(removed, 5000u) << "not enough to close gaps";
}

TEST(SurfelMap, AppendedSurfelsComeBackInOrder) {
  COMAP_DEVICE_OR_SKIP(device);
  SurfelMap map = mapOn(device, 1024);
  const auto surfels = someSurfels(5000);
  ASSERT_TRUE(map.append(std::span(surfels).first(2000)));
  ASSERT_TRUE(map.append(std::span(surfels).subspan(2000)));
  EXPECT_EQ(map.size(), surfels.size());
  const auto back = map.download();
  ASSERT_TRUE(back);
  EXPECT_TRUE(identical(*back, surfels));
  map.clear();
  EXPECT_EQ(map.size(), 0u);
  EXPECT_TRUE(map.download()->empty());
}

TEST(SurfelMap, MovesEachSurfelWithItsOwner) {
  COMAP_DEVICE_OR_SKIP(device);
  SurfelMap map = mapOn(device);
  const auto surfels = someSurfels(3000);
  ASSERT_TRUE(map.append(surfels));
  std::vector<Pose> motions(4);  // owner 4 is beyond the list
  motions[1] = Pose(Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d(1, 2, 3).normalized())),
                    Eigen::Vector3d(1, -2, 0.5));
  ASSERT_TRUE(map.moveOwners(motions));
  const auto moved = map.download();
  ASSERT_TRUE(moved);
  for (size_t i = 0; i < surfels.size(); ++i) {
    if (surfels[i].owner != 1) {
      ASSERT_TRUE(identical((*moved)[i], surfels[i])) << i;
      continue;
    }
    const Eigen::Vector3d expected = motions[1] * surfels[i].position.cast<double>();
    const Eigen::Vector3d normal = motions[1].rotation() * surfels[i].normal.cast<double>();
    ASSERT_LT(((*moved)[i].position.cast<double>() - expected).norm(), 1e-3) << i;  // of positions up to 3000 m
    ASSERT_LT(((*moved)[i].normal.cast<double>() - normal).norm(), 1e-6) << i;
  }
}

// What is absorbed is there, after what was there, where the pose puts it; both go on as one map.
TEST(SurfelMap, AbsorbsAnotherOfItsPool) {
  COMAP_DEVICE_OR_SKIP(device);
  const auto pool = SurfelPool::create(device, 0);
  ASSERT_TRUE(pool);
  const auto surfels = someSurfels(3000);
  const Pose T_map_other(Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Eigen::Vector3d(1, 2, 3).normalized())),
                         Eigen::Vector3d(1, -2, 0.5));
  for (const Pose& T : {T_map_other, Pose()}) {
    SurfelMap map(*pool, {}), other(*pool, {});
    ASSERT_TRUE(map.append(std::span(surfels).first(1000)) && other.append(std::span(surfels).subspan(1000)));
    Follower follower, follower_of_other;
    follower.follow(map);
    follower_of_other.follow(other);
    ASSERT_TRUE(map.absorb(other, T));
    EXPECT_EQ(other.size(), 0u);
    EXPECT_EQ(map.size(), surfels.size());
    const auto all = map.download();
    ASSERT_TRUE(all);
    EXPECT_TRUE(identical({all->begin(), all->begin() + 1000}, {surfels.begin(), surfels.begin() + 1000}));
    for (size_t i = 1000; i < all->size(); ++i) {
      const Eigen::Vector3d expected = T * surfels[i].position.cast<double>();
      ASSERT_LT(((*all)[i].position.cast<double>() - expected).norm(), 1e-3) << i;  // of positions up to 3000 m
      ASSERT_LT(((*all)[i].normal.cast<double>() - T.rotation() * surfels[i].normal.cast<double>()).norm(), 1e-6) << i;
      ASSERT_EQ((*all)[i].owner, surfels[i].owner);
    }
    EXPECT_GT(follower.follow(map), 0u);
    EXPECT_EQ(follower_of_other.follow(other), 0u);
    fuseRoom(map, 3);
    follower.follow(map);
    fuseRoom(other, 1);
    follower_of_other.follow(other);
  }
}

TEST(SurfelMap, RefusesToAbsorbItselfAndMapsOfOtherPools) {
  COMAP_DEVICE_OR_SKIP(device);
  SurfelMap map = mapOn(device), other = mapOn(device);
  ASSERT_TRUE(map.append(someSurfels(10)) && other.append(someSurfels(20)));
  for (SurfelMap* one : {&map, &other}) {
    const auto absorbed = map.absorb(*one, Pose());
    ASSERT_FALSE(absorbed);
    EXPECT_EQ(absorbed.error().code, ErrorCode::kWrongUse);
  }
  EXPECT_EQ(map.size(), 10u);
  EXPECT_EQ(other.size(), 20u);
}

TEST(Compaction, KeepsOrderAndContent) {
  COMAP_DEVICE_OR_SKIP(device);
  auto& context = device.context();
  const auto surfels = someSurfels(4097);
  StreamRows rows = pack(surfels);
  std::vector<Surfel> expected;
  for (size_t i = 0; i < surfels.size(); ++i) {
    if (i % 3 == 0 || (i > 1000 && i < 2100))
      rows.places[i][3] = -1;
    else
      expected.push_back(surfels[i]);
  }
  const auto kernels = SurfelKernels::create(context);
  auto streams = SurfelStreams::create(context, surfels.size());
  auto target = SurfelStreams::create(context, surfels.size());
  FusionScratch scratch;
  ASSERT_TRUE(kernels && streams && target && writeRows(*streams, rows, 0));
  const auto left =
      compactStreams(context, *kernels, *streams, *target, scratch, static_cast<uint32_t>(surfels.size()));
  ASSERT_TRUE(left) << left.error().text;
  ASSERT_EQ(*left, expected.size());
  const auto back = readRows(*target, *left);
  ASSERT_TRUE(back);
  EXPECT_TRUE(identical(unpack(*back), expected));
}

TEST(SurfelMap, RefusesWhatCannotBeFused) {
  COMAP_DEVICE_OR_SKIP(device);
  SurfelMap map = mapOn(device);
  const Frame frame = Scene::room().render(kCamera, Pose());
  const auto refused = [&](const CameraModel& camera, const ColourImage& colour, const DepthImage& depth,
                           const Pose& pose) {
    const auto report = map.fuse(camera, colour, depth, pose, 0, 1);
    return !report && report.error().code == ErrorCode::kWrongUse;
  };
  CameraModel other = kCamera;
  other.width = 159;
  EXPECT_TRUE(refused(other, frame.colour, frame.depth, Pose()));
  EXPECT_TRUE(refused(kCamera, ColourImage(160, 119), frame.depth, Pose()));
  EXPECT_TRUE(refused(kCamera, frame.colour, DepthImage(), Pose()));
  other = kCamera;
  other.fx = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(refused(other, frame.colour, frame.depth, Pose()));
  other.fx = 0;
  EXPECT_TRUE(refused(other, frame.colour, frame.depth, Pose()));
  const Pose nowhere(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, std::numeric_limits<double>::infinity(), 0));
  EXPECT_TRUE(refused(kCamera, frame.colour, frame.depth, nowhere));
  EXPECT_FALSE(map.predict(kCamera, nowhere, {}));
  EXPECT_FALSE(map.predict(CameraModel{100, 100, 0, 0, 0, 10}, Pose(), {}));
  EXPECT_FALSE(map.predict(CameraModel{100, 100, 0, 0, 100000, 100000}, Pose(), {}));
  auto broken = someSurfels(3);
  broken[1].normal.x() = std::numeric_limits<float>::quiet_NaN();
  const auto appended = map.append(broken);
  ASSERT_FALSE(appended);
  EXPECT_EQ(appended.error().code, ErrorCode::kBadData);
  EXPECT_NE(appended.error().text.find("surfel 1 "), std::string::npos) << appended.error().text;
  EXPECT_FALSE(map.moveOwners(std::vector<Pose>{nowhere}));
  EXPECT_EQ(map.size(), 0u);
}

TEST(SurfelMap, EmptyMapAndEmptyKeyframeAreFine) {
  COMAP_DEVICE_OR_SKIP(device);
  SurfelMap map = mapOn(device);
  const auto seen = map.predict(kCamera, Pose(), {});
  ASSERT_TRUE(seen);
  EXPECT_EQ(*std::max_element(seen->depth_m.data(), seen->depth_m.data() + seen->depth_m.size()), 0.0f);
  const auto report = map.fuse(kCamera, ColourImage(160, 120), DepthImage(160, 120), Pose(), 0, 1);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->total, 0u);
  EXPECT_TRUE(map.moveOwners(std::vector<Pose>(3)));
  EXPECT_TRUE(map.append({}));
}

}  // namespace
}  // namespace comap
