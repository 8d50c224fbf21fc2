// A camera that comes back to a place it remembers, far from where it believes to be.
#include "mapping_core/paper/global_loop.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "mapping_core/surfels/surfel_pool.h"
#include "tests/mapping_core/gpu/test_device.h"
#include "tests/scenes/scene.h"

namespace comap {
namespace {

const CameraModel kCamera = smallCamera();

Pose turned(double yaw_deg) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw_deg * std::numbers::pi / 180, Eigen::Vector3d::UnitY())),
          Eigen::Vector3d::Zero()};
}

// Once around on the spot, with drift that grows evenly; every view is remembered that is new.
struct Walk {
  static constexpr int kSteps = 30;

  Walk(gpu::Device& device, const PaperOptions& chosen, const Eigen::Vector3d& drift_m)
      : options(chosen),
        pool(*SurfelPool::create(device, 0, true)),
        frame{"a", TimedSurfelMap(pool, options.fusion), FernMemory(options.ferns)},
        cameras(1),
        registrar(options),
        book(FernBook::standard()) {
    for (int i = 0; i <= kSteps; ++i) {
      tick = static_cast<uint32_t>(i) + 1;
      const Frame image = scene.render(kCamera, turned(12.0 * i));
      const Pose believed =
          Pose(Eigen::Quaterniond::Identity(), drift_m * (i / static_cast<double>(kSteps))) * turned(12.0 * i);
      owners.push_back({0, tick});
      EXPECT_TRUE(frame.map.fuse(kCamera, image.colour, image.depth, believed, static_cast<uint32_t>(i),
                                 {SeenBy::kActive, 0, tick, 10}));
      PaperCamera& camera = cameras[0];
      camera.model = kCamera;
      camera.T_map_cam = believed;
      camera.log.push_back({tick, 0, believed});
      seen = viewOf(image);
      if (i < kSteps) frame.ferns.harvest(seen, {0, tick}, believed);
    }
  }

  FernView viewOf(const Frame& image) const {
    PredictedView nothing;
    nothing.depth_m = Image<float>(kCamera.width, kCamera.height, 0.0f);
    nothing.colour = image.colour;
    return fernViewOf(book, fillView(nothing, image, 0.3f, 5.0f), kCamera);
  }

  LoopReport close() {
    const LoopContext context{frame, cameras, cameras[0], owners, options, registrar, tick};
    const auto report = closeGlobalLoop(context, seen);
    EXPECT_TRUE(report);
    return *report;
  }

  // Median distance from the true surface of what the last steps have made.
  double newestMiss() const {
    std::vector<double> misses;
    const auto surfels = frame.map.download();
    for (const TimedSurfel& one : *surfels)
      if (owners[one.surfel.owner].tick + 4 > tick && owners[one.surfel.owner].tick < tick)
        misses.push_back(scene.distanceTo(one.surfel.position.cast<double>()));
    std::sort(misses.begin(), misses.end());
    EXPECT_GT(misses.size(), 100u);
    return misses.empty() ? 0 : misses[misses.size() / 2];
  }

  Scene scene = Scene::room();
  PaperOptions options;
  std::shared_ptr<SurfelPool> pool;
  ReferenceFrame frame;
  std::vector<PaperCamera> cameras;
  std::vector<FrameTime> owners;
  Registrar registrar;
  FernBook book;
  FernView seen;
  uint32_t tick = 0;
};

PaperOptions quickOptions() {
  PaperOptions options;
  options.ferns.min_age = 15;
  options.graph.stride = 250;
  options.graph.global_share = 2;
  return options;
}

TEST(GlobalLoop, DriftIsBentAwayFromMapAndTrajectory) {
  COMAP_DEVICE_OR_SKIP(device);
  Walk walk(device, quickOptions(), {0.1, 0.05, 0.1});
  const double middle_before = walk.cameras[0].log[Walk::kSteps / 2].T_map_cam.translation().norm();
  const double miss_before = walk.newestMiss();
  const LoopReport report = walk.close();
  ASSERT_TRUE(report.closed) << report.solve.mean_error_m << " m, cost " << report.solve.cost;
  EXPECT_GT(report.solve.start_error_m, 0.12);
  EXPECT_LT(walk.cameras[0].T_map_cam.translation().norm(), 0.02);
  EXPECT_LT(walk.cameras[0].log.back().T_map_cam.translation().norm(), 0.03);
  EXPECT_LT(walk.cameras[0].log.front().T_map_cam.translation().norm(), 0.01) << "the old side stays";
  EXPECT_LT(walk.cameras[0].log[Walk::kSteps / 2].T_map_cam.translation().norm(), middle_before);
  EXPECT_LT(walk.newestMiss(), miss_before / 2) << "the surfaces are bent with the trajectory";
}

TEST(GlobalLoop, LittleDriftAndPlacesOfJustNowAreLeftAlone) {
  COMAP_DEVICE_OR_SKIP(device);
  Walk walk(device, quickOptions(), {0.03, 0, 0.02});
  const Pose before = walk.cameras[0].T_map_cam;
  EXPECT_FALSE(walk.close().closed);
  EXPECT_EQ(walk.cameras[0].T_map_cam.matrix(), before.matrix());

  walk.options.ferns.least_drift_m = 0;
  walk.options.ferns.min_age = 300;
  const LoopContext context{walk.frame,   walk.cameras,   walk.cameras[0], walk.owners,
                            walk.options, walk.registrar, walk.tick};
  EXPECT_FALSE(mayCloseGlobalLoop(context));
  EXPECT_FALSE(walk.close().closed);
  // The same walk, with the places old enough and the drift large enough: the refusals above were theirs alone.
  walk.options.ferns.min_age = 15;
  EXPECT_TRUE(mayCloseGlobalLoop(context));
  const LoopReport report = walk.close();
  EXPECT_TRUE(report.closed) << report.solve.mean_error_m << " m, cost " << report.solve.cost;
  EXPECT_LT(walk.cameras[0].T_map_cam.translation().norm(), before.translation().norm() / 2);
}

}  // namespace
}  // namespace comap
