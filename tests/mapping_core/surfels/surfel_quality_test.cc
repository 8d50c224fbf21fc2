// What the map is for: accurate, complete, without doubles, and following what changes.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "mapping_core/surfels/surfel_map.h"
#include "tests/mapping_core/gpu/test_device.h"
#include "tests/scenes/scene.h"

namespace comap {
namespace {

const CameraModel kCamera{131.25, 131.25, 79.5, 59.5, 160, 120};

SurfelMap mapOn(gpu::Device& device) {
  FusionParameters parameters;
  parameters.initial_capacity = 1 << 16;
  auto map = SurfelMap::create(device, parameters);
  EXPECT_TRUE(map) << map.error().text;
  return std::move(*map);
}

// A plane n.x = d in front of the camera at the origin, without rounding noise beyond the depth unit.
DepthImage planeDepth(const Eigen::Vector3d& normal, double distance, double noise_m, std::mt19937* random) {
  DepthImage depth(kCamera.width, kCamera.height);
  std::normal_distribution<double> noise(0, noise_m);
  for (int v = 0; v < kCamera.height; ++v) {
    for (int u = 0; u < kCamera.width; ++u) {
      const double z = distance / normal.dot(kCamera.unproject(u, v, 1)) + (random ? noise(*random) : 0);
      depth.at(u, v) = static_cast<uint16_t>(std::lround(z * kDepthUnitsPerMetre));
    }
  }
  return depth;
}

const ColourImage kGrey(160, 120, {128, 128, 128});

// A half-pixel offset anywhere would show as a depth error of about 0.5 px * slope * z / f, here over 5 mm.
TEST(SurfelQuality, SlantedPlaneRoundTripHasNoOffset) {
  COMAP_DEVICE_OR_SKIP(device);
  for (const Eigen::Vector3d& direction : {Eigen::Vector3d(0.7, 0, 1), Eigen::Vector3d(0, -0.7, 1)}) {
    const Eigen::Vector3d normal = direction.normalized();
    SurfelMap map = mapOn(device);
    const DepthImage depth = planeDepth(normal, 1.5, 0, nullptr);
    for (uint32_t k = 0; k < 3; ++k) ASSERT_TRUE(map.fuse(kCamera, kGrey, depth, Pose(), k, 1));
    const auto surfels = map.download();
    ASSERT_TRUE(surfels && surfels->size() > 1000);
    for (const Surfel& s : *surfels) ASSERT_NEAR(normal.dot(s.position.cast<double>()), 1.5, 3e-4);
    const auto seen = map.predict(kCamera, Pose(), {0, 20, false});
    ASSERT_TRUE(seen);
    size_t filled = 0;
    double sum = 0;
    for (int v = 0; v < kCamera.height; ++v) {
      for (int u = 0; u < kCamera.width; ++u) {
        if (seen->depth_m.at(u, v) <= 0) continue;
        ++filled;
        const double error = seen->depth_m.at(u, v) - 1.5 / normal.dot(kCamera.unproject(u, v, 1));
        sum += error;
        ASSERT_LT(std::abs(error), 2e-3) << u << ", " << v;
      }
    }
    EXPECT_GT(filled, seen->depth_m.size() * 9 / 10);
    EXPECT_LT(std::abs(sum / static_cast<double>(filled)), 1e-4);
  }
}

double rmsFromPlane(const std::vector<Surfel>& surfels, double distance) {
  double sum = 0;
  for (const Surfel& s : surfels) sum += std::pow(s.position.z() - distance, 2);
  return std::sqrt(sum / static_cast<double>(surfels.size()));
}

TEST(SurfelQuality, StaticNoisyPlaneSettlesAndSharpens) {
  COMAP_DEVICE_OR_SKIP(device);
  SurfelMap map = mapOn(device);
  std::mt19937 random(5);
  double rms_first = 0;
  uint32_t total_at_10 = 0;
  for (uint32_t k = 0; k < 50; ++k) {
    const DepthImage depth = planeDepth(Eigen::Vector3d::UnitZ(), 2, 0.009, &random);
    const auto report = map.fuse(kCamera, kGrey, depth, Pose(), k, 1);
    ASSERT_TRUE(report) << report.error().text;
    if (k == 0) rms_first = rmsFromPlane(*map.download(), 2);
    if (k == 10) total_at_10 = report->total;
  }
  const auto surfels = map.download();
  ASSERT_TRUE(surfels);
  EXPECT_LT(rmsFromPlane(*surfels, 2), std::max(0.001, rms_first / 3));
  EXPECT_NEAR(static_cast<double>(surfels->size()), total_at_10, total_at_10 * 0.02);
  // No doubles: never two surfels within a third of a radius.
  Image<int> cells(400, 400, 0);
  const double cell_m = 0.004;
  size_t doubles = 0;
  for (const Surfel& s : *surfels) {
    const int x = static_cast<int>(std::floor(s.position.x() / cell_m)) + 200,
              y = static_cast<int>(std::floor(s.position.y() / cell_m)) + 200;
    if (cells.contains(x, y) && cells.at(x, y)++ > 0) ++doubles;
  }
  EXPECT_LE(doubles, surfels->size() / 200);
}

// A box stands at 1.8 m before `background` for ten keyframes, then ten see the background alone: surfels of the box
// after each of the two.
std::pair<size_t, size_t> boxThenNone(SurfelMap& map, const DepthImage& background) {
  DepthImage with_box = background;
  for (int v = 40; v < 80; ++v) {
    for (int u = 60; u < 100; ++u) with_box.at(u, v) = 9000;
  }
  const auto boxSurfels = [&] {
    size_t count = 0;
    const auto surfels = map.download();
    EXPECT_TRUE(surfels);
    for (const Surfel& s : *surfels) count += s.position.z() < 2.2f;
    return count;
  };
  for (uint32_t k = 0; k < 10; ++k) EXPECT_TRUE(map.fuse(kCamera, kGrey, with_box, Pose(), k, 1));
  const size_t with = boxSurfels();
  for (uint32_t k = 10; k < 20; ++k) EXPECT_TRUE(map.fuse(kCamera, kGrey, background, Pose(), k, 1));
  return {with, boxSurfels()};
}

TEST(SurfelQuality, BoxThatMovesAwayVanishes) {
  COMAP_DEVICE_OR_SKIP(device);
  SurfelMap map = mapOn(device);
  const auto [with, without] = boxThenNone(map, planeDepth(Eigen::Vector3d::UnitZ(), 2.5, 0, nullptr));
  EXPECT_GT(with, 200u);
  EXPECT_EQ(without, 0u);
  const auto seen = map.predict(kCamera, Pose(), {1.5f, 20, false});
  ASSERT_TRUE(seen);
  EXPECT_NEAR(seen->depth_m.at(80, 60), 2.5, 0.005);  // and the wall behind has grown
}

// A hall, or a room seen through its door: the background is too far to be fused, not to be seen.
TEST(SurfelQuality, BoxBeforeABackgroundOutOfRangeVanishes) {
  COMAP_DEVICE_OR_SKIP(device);
  SurfelMap map = mapOn(device);
  std::mt19937 random(5);
  const auto [with, without] = boxThenNone(map, planeDepth(Eigen::Vector3d::UnitZ(), 9, 0.1, &random));
  EXPECT_GT(with, 200u);
  EXPECT_EQ(without, 0u);
  EXPECT_EQ(map.size(), 0u);  // the background itself is none of it
}

// Beyond free_max_m a sensor's numbers mean nothing.
TEST(SurfelQuality, DepthBeyondTheSensorProvesNothing) {
  COMAP_DEVICE_OR_SKIP(device);
  SurfelMap map = mapOn(device);
  const auto [with, without] = boxThenNone(map, planeDepth(Eigen::Vector3d::UnitZ(), 12.5, 0, nullptr));
  EXPECT_GT(with, 200u);
  EXPECT_EQ(without, with);
}

// A thin post before a far wall: looking past it from many sides must not eat it.
TEST(SurfelQuality, SilhouettesAreNotEaten) {
  COMAP_DEVICE_OR_SKIP(device);
  SurfelMap map = mapOn(device);
  std::mt19937 random(9);
  size_t most = 0, last = 0;
  for (uint32_t k = 0; k < 20; ++k) {
    DepthImage depth = planeDepth(Eigen::Vector3d::UnitZ(), 3, 0.01, &random);
    for (int v = 0; v < 120; ++v) {
      const int jitter = static_cast<int>(random() % 2);
      for (int u = 70 + jitter; u < 84 + jitter; ++u) depth.at(u, v) = 7500;  // 1.5 m
    }
    ASSERT_TRUE(map.fuse(kCamera, kGrey, depth, Pose(), k, 1));
    last = 0;
    const auto surfels = map.download();
    ASSERT_TRUE(surfels);
    for (const Surfel& s : *surfels) last += s.position.z() < 2;
    most = std::max(most, last);
  }
  EXPECT_GT(most, 200u);
  EXPECT_GT(last, most * 9 / 10);
}

TEST(SurfelQuality, RoomAtTruePosesIsAccurateAndComplete) {
  COMAP_DEVICE_OR_SKIP(device);
  SurfelMap map = mapOn(device);
  const Scene scene = Scene::room();
  const auto pose = [](int k) {
    return Pose(Eigen::Quaterniond(Eigen::AngleAxisd(0.1 * k, Eigen::Vector3d::UnitY())),
                Eigen::Vector3d(0.05 * k, 0.01 * k, 0));
  };
  for (int k = 0; k < 8; ++k) {
    const Frame frame = scene.render(kCamera, pose(k));
    ASSERT_TRUE(map.fuse(kCamera, frame.colour, frame.depth, pose(k), static_cast<uint32_t>(k), 1));
  }
  double sum = 0;
  size_t count = 0, valid = 0;
  for (int k = 0; k < 8; ++k) {
    const auto seen = map.predict(kCamera, pose(k), {1.0f, 20, false});
    ASSERT_TRUE(seen);
    const Frame frame = scene.render(kCamera, pose(k));
    for (int v = 0; v < kCamera.height; ++v) {
      for (int u = 0; u < kCamera.width; ++u) {
        const double truth = frame.depth.at(u, v) / kDepthUnitsPerMetre;
        if (truth < 0.3 || truth > 5) continue;
        ++valid;
        if (seen->depth_m.at(u, v) <= 0) continue;
        // Along the normal, and not where a disc reaches over an edge.
        const Eigen::Vector3d ray = kCamera.unproject(u, v, 1);
        const double error = std::abs((seen->depth_m.at(u, v) - truth) * seen->normal.at(u, v).cast<double>().dot(ray));
        if (error > 0.05) continue;
        sum += error;
        ++count;
      }
    }
  }
  EXPECT_LT(sum / static_cast<double>(count), 0.002);
  EXPECT_GT(count, valid * 85 / 100);
}

}  // namespace
}  // namespace comap
