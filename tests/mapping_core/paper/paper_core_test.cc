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

// b begins a metre to the right of a, out of its sight in most of its picture, and comes to where a has begun.
Pose firstAt(int i) { return along(0.004 * i); }
Pose secondAt(int i) { return along(0.8 - 0.025 * i, 12 - 0.36 * i); }

TEST(PaperCore, TwoCamerasMergeWhereOneSeesWhatTheOtherHasSeen) {
  COMAP_DEVICE_OR_SKIP(device);
  const Scene room = Scene::room();
  const auto core = makeCore(device, 2);
  constexpr int kFrames = 34;
  for (int i = 0; i < kFrames && core->maps().size() == 2; ++i) {
    ASSERT_TRUE(core->playRound({room.render(kCamera, firstAt(i), i), room.render(kCamera, secondAt(i), i)}));
  }
  ASSERT_EQ(core->maps().size(), 1u);
  ASSERT_EQ(core->merges().size(), 1u);
  const PaperMerge& merge = core->merges()[0];
  const bool into_a = merge.kept == "a";
  const Pose T_a_b = secondAt(0);
  const Pose error = (into_a ? T_a_b : T_a_b.inverse()).inverse() * merge.match.T_other_own;
  EXPECT_LT(error.translation().norm(), 0.02);
  EXPECT_LT(error.angle() * 180 / std::numbers::pi, 0.5);
  EXPECT_EQ(core->cameras()[0].frame, core->cameras()[1].frame);
  EXPECT_EQ(core->frameOf(0).ferns.places().size() > 1, true) << "places of both";
}

TEST(PaperCore, SameFramesGiveTheSameBitsAlsoThroughMergeAndLoop) {
  COMAP_DEVICE_OR_SKIP(device);
  const Scene room = Scene::room();
  std::vector<std::pair<Frame, Frame>> frames;
  std::vector<TimedSurfel> first;
  std::vector<LoggedPose> first_log;
  for (const int run : {0, 1}) {
    const auto core = makeCore(device, 2);
    bool looped = false;
    for (int i = 0; i < 40 && !looped; ++i) {
      if (run == 0) frames.emplace_back(room.render(kCamera, firstAt(i), i), room.render(kCamera, secondAt(i), i));
      if (static_cast<size_t>(i) == frames.size()) break;
      const auto& [a, b] = frames[static_cast<size_t>(i)];
      ASSERT_TRUE(core->playRound({a, b}));
      for (const PaperFrameRecord& record : core->records()) looped = looped || record.local_loop;
    }
    ASSERT_EQ(core->merges().size(), 1u) << "the run has a merge";
    ASSERT_TRUE(looped) << "and a local loop, onto the other camera's area";
    auto surfels = core->frameOf(0).map.download();
    ASSERT_TRUE(surfels && !surfels->empty());
    if (run == 0) {
      first = std::move(*surfels);
      first_log = core->cameras()[1].log;
      continue;
    }
    ASSERT_EQ(first_log.size(), core->cameras()[1].log.size());
    for (size_t i = 0; i < first_log.size(); ++i)
      ASSERT_EQ(first_log[i].T_map_cam.matrix(), core->cameras()[1].log[i].T_map_cam.matrix()) << i;
    ASSERT_EQ(first.size(), surfels->size());
    for (size_t i = 0; i < first.size(); ++i) {
      ASSERT_EQ(first[i].surfel.position, (*surfels)[i].surfel.position) << i;
      ASSERT_EQ(first[i].surfel.normal, (*surfels)[i].surfel.normal) << i;
      ASSERT_EQ(first[i].surfel.confidence, (*surfels)[i].surfel.confidence) << i;
      ASSERT_EQ(first[i].seen, (*surfels)[i].seen) << i;
    }
  }
}

TEST(PaperCore, AfterALostFrameTheCameraGoesOnFromTheLastTrackedOne) {
  COMAP_DEVICE_OR_SKIP(device);
  const Scene room = Scene::room();
  const auto core = makeCore(device, 1);
  int i = 0;
  for (; i < 12; ++i) ASSERT_TRUE(core->playRound({room.render(kCamera, along(0.01 * i), i)}));
  // A glimpse of elsewhere without any depth.
  Frame glimpse = room.render(kCamera, along(0, 25), i);
  glimpse.depth = DepthImage(kCamera.width, kCamera.height, 0);
  ASSERT_TRUE(core->playRound({glimpse}));
  ASSERT_TRUE(core->records().back().lost);
  const std::vector<LoggedPose>& log = core->cameras()[0].log;
  EXPECT_EQ(log[12].T_map_cam.matrix(), log[11].T_map_cam.matrix()) << "a lost frame keeps the pose";
  ASSERT_TRUE(core->playRound({room.render(kCamera, along(0.12), 13)}));
  EXPECT_FALSE(core->records().back().lost);
  EXPECT_LT((along(0.12).inverse() * log.back().T_map_cam).translation().norm(), 0.008);
  EXPECT_LT((along(0.12).inverse() * log.back().T_map_cam).angle() * 180 / std::numbers::pi, 0.3);
}

TEST(PaperCore, AFrameThatDoesNotFitIsFusedUnlessTrackingIsChecked) {
  COMAP_DEVICE_OR_SKIP(device);
  const Scene room = Scene::room();
  for (const bool checked : {false, true}) {
    PaperOptions options;
    options.fixes.check_tracking = checked;
    const auto core = makeCore(device, 1, options);
    int i = 0;
    for (; i < 12; ++i) ASSERT_TRUE(core->playRound({room.render(kCamera, along(0.01 * i), i)}));
    const size_t before = core->frameOf(0).map.size();
    // A hand before most of the lens: the rest still tells where the camera is.
    Frame covered = room.render(kCamera, along(0.12), i);
    for (int y = 0; y < kCamera.height; ++y)
      for (int x = 0; x < kCamera.width * 7 / 10; ++x) covered.depth.at(x, y) = kDepthUnitsPerMetre / 2;
    ASSERT_TRUE(core->playRound({covered}));
    EXPECT_EQ(core->records().back().lost, checked);
    if (checked)
      EXPECT_EQ(core->frameOf(0).map.size(), before);
    else
      EXPECT_GT(core->frameOf(0).map.size(), before);
  }
}

// a and b walk the same wall in opposite directions and meet in the middle.
TEST(PaperCore, WithTwoVotesOneMatchIsNotEnough) {
  COMAP_DEVICE_OR_SKIP(device);
  const Scene room = Scene::room();
  constexpr int kFrames = 44;
  std::vector<Frame> a, b;
  for (int i = 0; i < kFrames; ++i) {
    a.push_back(room.render(kCamera, along(0.02 * i), i));
    b.push_back(room.render(kCamera, along(0.8 - 0.02 * i), i));
  }
  std::vector<uint32_t> merged;
  for (const bool twice : {false, true}) {
    PaperOptions options;
    options.fixes.two_votes = twice;
    const auto core = makeCore(device, 2, options);
    for (size_t i = 0; i < kFrames && core->merges().empty(); ++i) ASSERT_TRUE(core->playRound({a[i], b[i]}));
    ASSERT_EQ(core->merges().size(), 1u) << twice;
    merged.push_back(core->merges()[0].tick);
  }
  EXPECT_GE(merged[1], merged[0] + 15) << "30 cm at 2 cm a frame lie between the two votes";
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
