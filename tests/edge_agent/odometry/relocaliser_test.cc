#include "edge_agent/odometry/relocaliser.h"

#include <gtest/gtest.h>

#include <cmath>
#include <iostream>

#include "mapping_core/ferns/fern_encoder.h"
#include "tests/scenes/scene.h"
#include "tests/scenes/scene_noise.h"

namespace comap {
namespace {

constexpr double kDegree = M_PI / 180;

struct View {
  Pyramid pyramid;
  FernCode code;
};

// Pictures of half a camera's size take the place of levels 1 to 3.
View viewOf(const Frame& frame) {
  View view;
  buildPyramid(frame.colour, frame.depth, frame.camera, 3, 0.3f, 6, view.pyramid);
  view.pyramid.insert(view.pyramid.begin(), PyramidLevel{});
  static const FernBook kBook = FernBook::standard();
  view.code = encodeFerns(kBook, frame.colour, frame.depth);
  return view;
}

View look(const Pose& T_world_cam, uint64_t scene_seed = 1, uint64_t noise_seed = 1) {
  Frame frame = Scene::room(scene_seed).render(smallCamera(), T_world_cam);
  addKinectNoise(frame, noise_seed);
  return viewOf(frame);
}

Pose standing(double yaw_degrees, const Eigen::Vector3d& place = {0, 0, 0}, double pitch_degrees = 0) {
  return Pose(Eigen::Quaterniond(Eigen::AngleAxisd(yaw_degrees * kDegree, Eigen::Vector3d::UnitY()) *
                                 Eigen::AngleAxisd(pitch_degrees * kDegree, Eigen::Vector3d::UnitX())),
              place);
}

constexpr int kPlaces = 12;
Pose placeAt(int i) { return standing(30 * i); }

// A turn in the middle of the room, as the robot remembers it: its odometry frame is not the world.
const Pose kT_odom_world = standing(40, {3, 0.2, -1});
Relocaliser remembering(const RelocaliserOptions& options = {}) {
  static const std::vector<View> kViews = [] {
    std::vector<View> views;
    for (int i = 0; i < kPlaces; ++i) views.push_back(look(placeAt(i)));
    return views;
  }();
  Relocaliser relocaliser(options);
  for (int i = 0; i < kPlaces; ++i)
    EXPECT_TRUE(relocaliser.add(static_cast<uint32_t>(100 + i), kT_odom_world * placeAt(i),
                                kViews[static_cast<size_t>(i)].code, kViews[static_cast<size_t>(i)].pyramid));
  return relocaliser;
}

TEST(Relocaliser, findsThePlaceFromAnotherPoseAndSaysWhereTheCameraIs) {
  Relocaliser relocaliser = remembering();
  int accepted = 0;
  for (int i = 0; i < kPlaces; ++i)
    for (const Pose& moved : {standing(4, {0.1, 0.02, 0.05}), standing(-8, {-0.08, 0, 0.1}, 5)}) {
      const Pose T_world_cam = placeAt(i) * moved;
      const View live = look(T_world_cam, 1, 9);
      const Relocalisation found = relocaliser.relocalise(live.pyramid, live.code);
      if (!found.accepted) {
        std::cout << "view " << i << " refused: " << found.reason << "\n";
        continue;
      }
      ++accepted;
      EXPECT_EQ(found.reason, "accepted");
      const Pose error = (kT_odom_world * T_world_cam).inverse() * found.T_odom_keyframe * found.T_keyframe_cam;
      EXPECT_LT(error.translation().norm(), 0.02) << i;
      EXPECT_LT(error.angle(), 0.6 * kDegree) << i;
      const Pose T_keyframe_cam = placeAt(static_cast<int>(found.sequence) - 100).inverse() * T_world_cam;
      EXPECT_LT((T_keyframe_cam.inverse() * found.T_keyframe_cam).translation().norm(), 0.02)
          << "it is the pose in the keyframe that is named";
    }
  // Sensor noise and a turn of 8 degrees may leave one or two in a wrong minimum; the gates refuse those.
  EXPECT_GE(accepted, 2 * kPlaces - 2);
}

TEST(Relocaliser, anotherExposureIsTheSamePlace) {
  Relocaliser relocaliser = remembering();
  Frame frame = Scene::room().render(smallCamera(), placeAt(2) * standing(3, {0.05, 0, 0}));
  changeExposure(frame, 0.8, 10);
  const View live = viewOf(frame);
  const Relocalisation found = relocaliser.relocalise(live.pyramid, live.code);
  EXPECT_TRUE(found.accepted) << found.reason;
  EXPECT_EQ(found.sequence, 102u);
}

// With every place admitted as a candidate: the gates alone must refuse.
RelocaliserOptions everyPlace() {
  RelocaliserOptions options;
  options.max_dissimilarity = 1;
  return options;
}

// The same walls and furniture with another texture: only the picture tells them apart.
TEST(Relocaliser, aRoomOfTheSameShapeIsNotTheSameRoom) {
  Relocaliser relocaliser = remembering(everyPlace());
  int photometric = 0;
  for (const uint64_t seed : {2, 3})
    for (int i = 0; i < kPlaces; ++i) {
      const View live = look(placeAt(i), seed);
      const Relocalisation found = relocaliser.relocalise(live.pyramid, live.code);
      EXPECT_FALSE(found.accepted) << "seed " << seed << " view " << i << " as " << found.sequence << " median "
                                   << found.photometric_median;
      photometric += found.reason == "photometric";
    }
  EXPECT_GT(photometric, 0) << "the twin's geometry fits: it is the picture that must refuse";
}

TEST(Relocaliser, aPartOfTheRoomThatIsNotRememberedIsNotFound) {
  Relocaliser relocaliser(everyPlace());
  for (const int i : {0, 1, 2}) {
    const View view = look(placeAt(i));
    ASSERT_TRUE(relocaliser.add(static_cast<uint32_t>(i), placeAt(i), view.code, view.pyramid));
  }
  for (int i = 5; i < 10; ++i) {
    const View live = look(placeAt(i));
    EXPECT_FALSE(relocaliser.relocalise(live.pyramid, live.code).accepted) << "view " << i;
  }
}

TEST(Relocaliser, aBareWallIsNoPlace) {
  Relocaliser relocaliser(everyPlace());
  const View wall = viewOf(Scene::plainPlane({0, 0, 2}, {0, 0, -1}).render(smallCamera(), Pose()));
  ASSERT_TRUE(relocaliser.add(0, Pose(), wall.code, wall.pyramid));
  const Relocalisation found = relocaliser.relocalise(wall.pyramid, wall.code);
  EXPECT_FALSE(found.accepted);
  EXPECT_EQ(found.reason, "degenerate");
}

// Two places that look the same: the robot cannot know which.
TEST(Relocaliser, twoEqualPlacesAreAmbiguous) {
  Relocaliser relocaliser{RelocaliserOptions{}};
  const View view = look(Pose());
  ASSERT_TRUE(relocaliser.add(0, Pose(), view.code, view.pyramid));
  const View live = look(standing(3, {0.05, 0, 0}), 1, 4);
  ASSERT_TRUE(relocaliser.relocalise(live.pyramid, live.code).accepted);
  ASSERT_TRUE(relocaliser.add(1, standing(90, {4, 0, 0}), view.code, view.pyramid));
  const Relocalisation found = relocaliser.relocalise(live.pyramid, live.code);
  EXPECT_FALSE(found.accepted);
  EXPECT_EQ(found.reason, "ambiguous");
}

TEST(Relocaliser, withoutMemoryLightOrLevelsItSaysWhy) {
  Relocaliser empty{RelocaliserOptions{}};
  const View live = look(Pose());
  EXPECT_EQ(empty.relocalise(live.pyramid, live.code).reason, "no_similar_place");
  Relocaliser relocaliser = remembering(everyPlace());
  const Pyramid few(live.pyramid.begin(), live.pyramid.begin() + kPlaceLevel + 1);
  EXPECT_EQ(relocaliser.relocalise(few, live.code).reason, "too_few_levels");
  const CameraModel camera = smallCamera();
  const View dark =
      viewOf({0, camera, ColourImage(camera.width, camera.height), DepthImage(camera.width, camera.height)});
  const Relocalisation found = relocaliser.relocalise(dark.pyramid, dark.code);
  EXPECT_FALSE(found.accepted);
  EXPECT_EQ(found.reason, "no_similar_place") << "a code without depth is like no other";
  EXPECT_FALSE(relocaliser.relocalise(dark.pyramid, live.code).accepted);
}

}  // namespace
}  // namespace comap
