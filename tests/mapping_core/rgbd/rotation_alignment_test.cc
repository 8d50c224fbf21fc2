#include "mapping_core/rgbd/rotation_alignment.h"

#include <gtest/gtest.h>

#include <cmath>

#include "mapping_core/rgbd/pyramid.h"
#include "protocol/types/pose.h"
#include "tests/scenes/scene.h"
#include "tests/scenes/scene_noise.h"

namespace comap {
namespace {

constexpr double kDegree = M_PI / 180;
constexpr int kCoarsest = 2;  // 80x60
const Eigen::Matrix3d kStill = Eigen::Matrix3d::Identity();

Eigen::Matrix3d turn(double degrees, const Eigen::Vector3d& axis) {
  return Eigen::AngleAxisd(degrees * kDegree, axis.normalized()).toRotationMatrix();
}

PyramidLevel levelOf(const Frame& frame, int level = kCoarsest) {
  Pyramid pyramid;
  buildPyramid(frame.colour, frame.depth, frame.camera, kCoarsest + 1, 0.3f, 6, pyramid);
  return pyramid[static_cast<size_t>(level)];
}

Frame view(const Pose& T_world_cam, uint64_t seed = 1) { return Scene::room(seed).render(smallCamera(), T_world_cam); }

double errorInDegrees(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return Eigen::AngleAxisd(a.transpose() * b).angle() / kDegree;
}

RotationAlignment align(const PyramidLevel& previous, const PyramidLevel& current,
                        const Eigen::Matrix3d& guess = kStill) {
  RotationWorkspace workspace;
  return alignRotation(previous.camera, previous.grey, current.grey, guess, {}, workspace);
}

PyramidLevel uniform(float grey) {
  PyramidLevel level{smallCamera().shrunk(4), {}, {}};
  level.grey = Image<float>(level.camera.width, level.camera.height, grey);
  return level;
}

// A picture defined at continuous places, so that its derivative along a turn is exact.
double smooth(double u, double v) { return 100 + 30 * std::sin(0.21 * u + 0.4) * std::cos(0.17 * v) + 0.3 * u; }
Eigen::Vector2d smoothGradient(double u, double v) {
  return {6.3 * std::cos(0.21 * u + 0.4) * std::cos(0.17 * v) + 0.3,
          -5.1 * std::sin(0.21 * u + 0.4) * std::sin(0.17 * v)};
}

TEST(RotationAlignment, jacobianIsThatOfTheResidual) {
  const CameraModel camera = smallCamera().shrunk(4);
  const Eigen::Matrix3d R = turn(7, {0.3, 1, -0.6});
  const auto greyAt = [&](const Eigen::Matrix3d& R_current_previous, const Eigen::Vector3d& ray) {
    const Eigen::Vector2d u = camera.project(R_current_previous * ray);
    return smooth(u.x(), u.y());
  };
  for (int y = 2; y < camera.height; y += 9)
    for (int x = 2; x < camera.width; x += 9) {
      const Eigen::Vector3d ray = camera.unproject(x, y, 1);
      const Eigen::Vector2d end = camera.project(R * ray), gradient = smoothGradient(end.x(), end.y());
      const Eigen::Vector3d m = camera.unproject(end.x(), end.y(), 1);
      const auto row = rotationJacobian<double>(m.x(), m.y(), gradient.x(), gradient.y(), camera.fx, camera.fy);
      for (int axis = 0; axis < 3; ++axis) {
        constexpr double kStep = 1e-6;
        const Eigen::Matrix3d forth = Eigen::AngleAxisd(kStep, Eigen::Vector3d::Unit(axis)).toRotationMatrix();
        const double numeric = (greyAt(forth * R, ray) - greyAt(forth.transpose() * R, ray)) / (2 * kStep);
        EXPECT_NEAR(row[static_cast<size_t>(axis)], numeric, 1e-4 * (1 + std::abs(numeric)))
            << x << " " << y << " axis " << axis;
      }
    }
}

class PureRotation : public testing::TestWithParam<std::tuple<int, double>> {};

TEST_P(PureRotation, isFoundWithoutAGuess) {
  const auto [place, degrees] = GetParam();
  const std::vector<Eigen::Vector3d> axes = {{0, 1, 0}, {0, -1, 0}, {1, 0, 0},    {-1, 0, 0},
                                             {0, 0, 1}, {1, 1, 1},  {-1, 2, -0.5}};
  const Pose T_world_previous(turn(72 * place, {0, 1, 0}), {0.2 * place - 0.4, 0.1, -0.5});
  const PyramidLevel previous = levelOf(view(T_world_previous));
  for (const Eigen::Vector3d& axis : axes) {
    const Eigen::Matrix3d R = turn(degrees, axis);
    Frame frame = view(T_world_previous * Pose(R, Eigen::Vector3d::Zero()));
    addKinectNoise(frame, 7);
    const RotationAlignment found = align(previous, levelOf(frame));
    EXPECT_TRUE(found.usable) << axis.transpose() << " error " << found.mean_error << " overlap " << found.overlap
                              << " weakest " << found.weakest_grey_per_degree;
    EXPECT_LT(errorInDegrees(found.R_previous_current, R), 0.3) << axis.transpose();
    EXPECT_LT(found.mean_error, found.start_error);
  }
}

INSTANTIATE_TEST_SUITE_P(, PureRotation, testing::Combine(testing::Range(0, 5), testing::Values(2.0, 6.0, 10.0)));

TEST(RotationAlignment, aWrongGuessDoesNoHarmAndAGoodOneReachesFurther) {
  const PyramidLevel previous = levelOf(view(Pose()));
  const Eigen::Matrix3d small = turn(2, {0, 1, 0}), large = turn(18, {0, 1, 0.2});
  const PyramidLevel near = levelOf(view(Pose(small, Eigen::Vector3d::Zero())));
  const RotationAlignment misled = align(previous, near, turn(-14, {0, 1, 0}));
  EXPECT_TRUE(misled.usable);
  EXPECT_LT(errorInDegrees(misled.R_previous_current, small), 0.3);
  const PyramidLevel far = levelOf(view(Pose(large, Eigen::Vector3d::Zero())));
  const RotationAlignment led = align(previous, far, turn(14, {0, 1, 0}));
  EXPECT_TRUE(led.usable);
  EXPECT_LT(errorInDegrees(led.R_previous_current, large), 0.3);
}

TEST(RotationAlignment, worksOnALargerLevelToo) {
  const Eigen::Matrix3d R = turn(9, {0.2, 1, 0.1});
  const PyramidLevel previous = levelOf(view(Pose()), 1);
  const RotationAlignment found = align(previous, levelOf(view(Pose(R, Eigen::Vector3d::Zero())), 1));
  EXPECT_TRUE(found.usable);
  EXPECT_LT(errorInDegrees(found.R_previous_current, R), 0.15);
}

// A walking robot's frame to frame motion is no pure rotation.
TEST(RotationAlignment, aLittleParallaxIsNotTakenForMuchTurning) {
  const PyramidLevel previous = levelOf(view(Pose()));
  for (const double degrees : {0.0, 3.0, 8.0}) {
    const Eigen::Matrix3d R = turn(degrees, {0.1, 1, 0});
    for (const Eigen::Vector3d& moved : {Eigen::Vector3d(0.03, 0, 0), Eigen::Vector3d(0, 0.02, 0.03)}) {
      const RotationAlignment found = align(previous, levelOf(view(Pose(R, moved))));
      EXPECT_TRUE(found.usable);
      // 3 cm sideways look like a turn of 0.86 degrees at 2 m.
      EXPECT_LT(errorInDegrees(found.R_previous_current, R), 1.2) << degrees << " degrees, " << moved.transpose();
    }
  }
}

TEST(RotationAlignment, exposureAndAThingThatMovesDoNotTurnTheCamera) {
  const Eigen::Matrix3d R = turn(6, {0, 1, 0});
  const PyramidLevel previous = levelOf(view(Pose()));
  Frame brighter = view(Pose(R, Eigen::Vector3d::Zero()));
  changeExposure(brighter, 0.75, 30);
  const RotationAlignment exposed = align(previous, levelOf(brighter));
  EXPECT_TRUE(exposed.usable);
  EXPECT_LT(errorInDegrees(exposed.R_previous_current, R), 0.3);
  Frame occluded = view(Pose(R, Eigen::Vector3d::Zero()));
  for (int y = 100; y < 220; ++y)
    for (int x = 30; x < 110; ++x) occluded.colour.at(x, y) = {250, 250, 250};
  const RotationAlignment passed = align(previous, levelOf(occluded));
  EXPECT_TRUE(passed.usable);
  EXPECT_LT(errorInDegrees(passed.R_previous_current, R), 0.6);
}

TEST(RotationAlignment, standingStillIsUsable) {
  Frame first = view(Pose()), second = first;
  addKinectNoise(first, 1);
  addKinectNoise(second, 2);
  const RotationAlignment found = align(levelOf(first), levelOf(second));
  EXPECT_TRUE(found.usable);
  EXPECT_LT(errorInDegrees(found.R_previous_current, kStill), 0.05);
}

TEST(RotationAlignment, picturesThatSayNothingLeaveTheGuess) {
  const Eigen::Matrix3d guess = turn(3, {0, 1, 0});
  const PyramidLevel room = levelOf(view(Pose()));
  Frame noisy = Scene::plainPlane({0, 0, 2}, {0, 0, -1}).render(smallCamera(), Pose());
  addKinectNoise(noisy, 3);
  Frame noisy_again = noisy;
  addKinectNoise(noisy_again, 4);
  const PyramidLevel wall = levelOf(noisy), wall_again = levelOf(noisy_again);
  const PyramidLevel none{smallCamera().shrunk(4), {}, {}};
  const std::vector<std::pair<const char*, RotationAlignment>> results = {
      {"black", align(uniform(0), uniform(0), guess)},
      {"constant", align(uniform(90), uniform(200), guess)},
      {"lights out", align(room, uniform(0), guess)},
      {"lights on", align(uniform(0), room, guess)},
      {"bare wall", align(wall, wall_again, guess)},
      {"empty picture", align(room, none, guess)},
      {"another room", align(room, levelOf(view(Pose(), 2)), guess)}};
  for (const auto& [what, result] : results) {
    EXPECT_FALSE(result.usable) << what << " error " << result.mean_error << " weakest "
                                << result.weakest_grey_per_degree;
    EXPECT_EQ(result.R_previous_current, guess) << what;
    EXPECT_TRUE(std::isfinite(result.mean_error) && std::isfinite(result.start_error)) << what;
    EXPECT_TRUE(std::isfinite(result.overlap) && std::isfinite(result.weakest_grey_per_degree)) << what;
  }
}

TEST(RotationAlignment, keepsItsBuffers) {
  const PyramidLevel previous = levelOf(view(Pose())), current = levelOf(view(Pose(turn(5, {0, 1, 0}), {0, 0, 0})));
  RotationWorkspace workspace;
  const auto run = [&] { return alignRotation(previous.camera, previous.grey, current.grey, kStill, {}, workspace); };
  const RotationAlignment first = run();
  ASSERT_FALSE(workspace.halved.empty());
  std::vector<const float*> buffers;
  for (const auto& level : workspace.halved) buffers.push_back(level.previous.data());
  const RotationAlignment second = run();
  EXPECT_EQ(first.R_previous_current, second.R_previous_current);
  ASSERT_EQ(workspace.halved.size(), buffers.size());
  for (size_t i = 0; i < buffers.size(); ++i) EXPECT_EQ(workspace.halved[i].previous.data(), buffers[i]);
}

}  // namespace
}  // namespace comap
