// Cameras in analytic rooms, through the whole of the paper mode.
#include "mapping_core/paper/paper_core.h"

#include <gtest/gtest.h>

#include <numbers>

#include "tests/mapping_core/gpu/test_device.h"
#include "tests/scenes/scene.h"

namespace comap {
namespace {

const CameraModel kCamera = smallCamera();

// Sideways along the room, looking at its far wall.
Pose along(double metres, double yaw_deg = 0) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(yaw_deg * std::numbers::pi / 180, Eigen::Vector3d::UnitY())),
          Eigen::Vector3d(metres, 0, 0)};
}

std::unique_ptr<PaperCore> makeCore(gpu::Device& device, int cameras, const PaperOptions& options = {}) {
  auto core = PaperCore::create(device, options, [](const std::string&) {});
  EXPECT_TRUE(core);
  for (int i = 0; i < cameras; ++i) EXPECT_TRUE((*core)->addCamera(std::string(1, static_cast<char>('a' + i))));
  return std::move(*core);
}

TEST(PaperCore, OneCameraTracksItsModel) {
  COMAP_DEVICE_OR_SKIP(device);
  const Scene room = Scene::room();
  const auto core = makeCore(device, 1);
  constexpr int kFrames = 20;
  for (int i = 0; i < kFrames; ++i) {
    const auto played = core->playRound({room.render(kCamera, along(0.01 * i, 0.4 * i), i)});
    ASSERT_TRUE(played) << played.error().text;
  }
  const PaperCamera& camera = core->cameras()[0];
  ASSERT_EQ(camera.log.size(), static_cast<size_t>(kFrames));
  for (int i = 0; i < kFrames; ++i) {
    const Pose error = along(0.01 * i, 0.4 * i).inverse() * camera.log[static_cast<size_t>(i)].T_map_cam;
    EXPECT_LT(error.translation().norm(), 0.008) << i;
    EXPECT_LT(error.angle() * 180 / std::numbers::pi, 0.3) << i;
  }
  EXPECT_GE(camera.filled.dense_share, 0.3) << "after ten frames much is stable";
}

TEST(PaperCore, TwoCamerasMergeWhereOneSeesWhatTheOtherHasSeen) {
  COMAP_DEVICE_OR_SKIP(device);
  const Scene room = Scene::room();
  const auto core = makeCore(device, 2);
  // b begins a metre to the right, out of a's sight in most of its picture, and comes to where a has begun.
  constexpr int kFrames = 34;
  const auto b_at = [](int i) { return along(0.8 - 0.025 * i, 12 - 0.36 * i); };
  for (int i = 0; i < kFrames && core->maps().size() == 2; ++i) {
    ASSERT_TRUE(core->playRound({room.render(kCamera, along(0.004 * i), i), room.render(kCamera, b_at(i), i)}));
  }
  ASSERT_EQ(core->maps().size(), 1u);
  ASSERT_EQ(core->merges().size(), 1u);
  const PaperMerge& merge = core->merges()[0];
  const bool into_a = merge.kept == "a";
  const Pose T_a_b = b_at(0);
  const Pose error = (into_a ? T_a_b : T_a_b.inverse()).inverse() * merge.match.T_other_own;
  EXPECT_LT(error.translation().norm(), 0.02);
  EXPECT_LT(error.angle() * 180 / std::numbers::pi, 0.5);
  EXPECT_EQ(core->cameras()[0].frame, core->cameras()[1].frame);
  EXPECT_EQ(core->frameOf(0).ferns.places().size() > 1, true) << "places of both";
}

TEST(PaperCore, SameFramesGiveTheSameBits) {
  COMAP_DEVICE_OR_SKIP(device);
  const Scene room = Scene::room();
  std::vector<TimedSurfel> first;
  for (const int run : {0, 1}) {
    const auto core = makeCore(device, 2);
    for (int i = 0; i < 5; ++i)
      ASSERT_TRUE(
          core->playRound({room.render(kCamera, along(0.01 * i), i), room.render(kCamera, along(0.3 + 0.01 * i), i)}));
    auto surfels = core->frameOf(0).map.download();
    ASSERT_TRUE(surfels && !surfels->empty());
    if (run == 0) {
      first = std::move(*surfels);
      continue;
    }
    ASSERT_EQ(first.size(), surfels->size());
    for (size_t i = 0; i < first.size(); ++i) {
      ASSERT_EQ(first[i].surfel.position, (*surfels)[i].surfel.position) << i;
      ASSERT_EQ(first[i].surfel.confidence, (*surfels)[i].surfel.confidence) << i;
      ASSERT_EQ(first[i].seen, (*surfels)[i].seen) << i;
    }
  }
}

TEST(PaperCore, RoundsAndFramesThatDoNotFitAreRefused) {
  COMAP_DEVICE_OR_SKIP(device);
  const auto core = makeCore(device, 1);
  Frame frame = Scene::room().render(kCamera, Pose());
  frame.depth = DepthImage(10, 10);
  const auto played = core->playRound({frame});
  ASSERT_FALSE(played);
  EXPECT_EQ(played.error().code, ErrorCode::kWrongUse);
  EXPECT_NE(played.error().text.find("10 x 10"), std::string::npos) << played.error().text;
  EXPECT_FALSE(core->playRound({}));
  EXPECT_TRUE(core->playRound({std::nullopt})) << "a camera may have nothing to show";
  EXPECT_TRUE(core->cameras()[0].log.empty());
}

TEST(PaperCore, ANinthCameraIsRefused) {
  COMAP_DEVICE_OR_SKIP(device);
  const auto core = makeCore(device, 8);
  const auto refused = core->addCamera("ninth");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kWrongUse);
}

}  // namespace
}  // namespace comap
