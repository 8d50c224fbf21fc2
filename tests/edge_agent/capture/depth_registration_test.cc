#include "edge_agent/capture/depth_registration.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/scenes/scene.h"

namespace comap {
namespace {

// Depth of the scene in millimetres, as a sensor at T_world_depth with this lens delivers it.
DepthImage sense(const Scene& scene, const Lens& lens, const Pose& T_world_depth) {
  DepthImage values(lens.pinhole.width, lens.pinhole.height);
  for (int v = 0; v < values.height(); ++v) {
    for (int u = 0; u < values.width(); ++u) {
      const auto ray = lens.rayOf(u, v);
      if (!ray) continue;
      const CameraModel unit{1, 1, 0, 0, 1, 1};
      const auto depth = scene.depthAt(unit, T_world_depth, ray->x(), ray->y());
      if (depth) values.at(u, v) = static_cast<uint16_t>(std::lround(*depth * 1000));
    }
  }
  return values;
}

CameraRig rig() {
  CameraRig made;
  made.colour.pinhole = {262, 262, 159.5, 119.5, 320, 240};
  made.depth.pinhole = {290, 291, 161, 118, 320, 240};
  made.depth.k1 = -0.05;
  made.depth.p1 = 0.001;
  made.T_colour_depth = Pose(Eigen::Quaterniond(Eigen::AngleAxisd(0.02, Eigen::Vector3d(0.3, 1, 0.5).normalized())),
                             {-0.025, 0.002, 0.004});
  return made;
}

TEST(DepthRegistration, IsWhatTheColourCameraWouldMeasure) {
  const CameraRig made = rig();
  const Scene scene = Scene::room();
  const Pose T_world_colour(Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitY())), {0.2, -0.1, -0.5});
  DepthRegistration registration(made, made.colour.pinhole, false);
  const DepthImage found = registration.apply(sense(scene, made.depth, T_world_colour * made.T_colour_depth));
  int right = 0, wrong = 0, empty = 0;
  double worst_inside_m = 0;
  for (int v = 20; v < 220; ++v) {
    for (int u = 25; u < 295; ++u) {
      const double wanted_m = scene.depthAt(made.colour.pinhole, T_world_colour, u, v).value();
      if (found.at(u, v) == 0) {
        ++empty;
        continue;
      }
      const double error_m = std::abs(found.at(u, v) / kDepthUnitsPerMetre - wanted_m);
      // A value is that of the depth pixel that covers this one: at most a pixel's slope away, and half a millimetre.
      const double slope_m = 0.5 * (std::abs(scene.depthAt(made.colour.pinhole, T_world_colour, u + 1, v).value() -
                                             scene.depthAt(made.colour.pinhole, T_world_colour, u - 1, v).value()) +
                                    std::abs(scene.depthAt(made.colour.pinhole, T_world_colour, u, v + 1).value() -
                                             scene.depthAt(made.colour.pinhole, T_world_colour, u, v - 1).value()));
      if (error_m < 0.0012 + slope_m) {
        ++right;
        worst_inside_m = std::max(worst_inside_m, error_m);
      } else {
        ++wrong;
      }
    }
  }
  // What is wrong or empty lies along the edges of things, which the two cameras see past differently.
  EXPECT_GT(right, 0.97 * 200 * 270) << wrong << " wrong, " << empty << " empty";
  EXPECT_LT(wrong, 0.01 * 200 * 270);
}

TEST(DepthRegistration, TheNearestWinsAndWhatIsHiddenIsNotSeen) {
  CameraRig made = rig();
  made.depth = made.colour;
  made.T_colour_depth = Pose(Eigen::Quaterniond::Identity(), {-0.1, 0, 0});
  DepthImage values(320, 240, 2000);
  for (int v = 100; v < 140; ++v)
    for (int u = 140; u < 180; ++u) values.at(u, v) = 1000;
  DepthRegistration registration(made, made.colour.pinhole, false);
  const DepthImage found = registration.apply(values);
  // At 1 m the box moves by 26.2 pixels to the left, the wall at 2 m by 13.1; between them nothing was seen.
  for (int u = 115; u < 153; ++u) EXPECT_EQ(found.at(u, 120), 5000) << u;
  for (int u = 155; u < 166; ++u) EXPECT_EQ(found.at(u, 120), 0) << u;
  EXPECT_EQ(found.at(170, 120), 10000);
  EXPECT_EQ(found.at(100, 120), 10000);
  EXPECT_EQ(found.at(319, 120), 0) << "outside of what the depth camera sees";
}

TEST(DepthRegistration, AWallHasNoHoles) {
  const CameraRig made = rig();
  for (const double tilt : {0.0, 0.6, 0.9}) {
    const Scene wall =
        Scene::plainPlane({0, 0, 1.5}, Eigen::Vector3d(std::sin(tilt), 0.1, -std::cos(tilt)).normalized());
    const Pose T_world_colour;
    DepthRegistration registration(made, made.colour.pinhole, false);
    const DepthImage found = registration.apply(sense(wall, made.depth, T_world_colour * made.T_colour_depth));
    int holes = 0;
    for (int v = 30; v < 210; ++v)
      for (int u = 60; u < 260; ++u) {
        const auto depth_m = wall.depthAt(made.colour.pinhole, T_world_colour, u, v);
        holes += depth_m && *depth_m < 6 && found.at(u, v) == 0;
      }
    EXPECT_EQ(holes, 0) << tilt;
  }
}

// A depth camera with fewer pixels fills the picture of a finer colour camera.
TEST(DepthRegistration, CoarseDepthCoversFineColour) {
  CameraRig made;
  made.colour.pinhole = {525, 525, 319.5, 239.5, 640, 480};
  made.depth.pinhole = {131, 131, 79.5, 59.5, 160, 120};
  DepthRegistration registration(made, made.colour.pinhole, false);
  const DepthImage found = registration.apply(DepthImage(160, 120, 1234));
  for (int v = 5; v < 475; ++v)
    for (int u = 5; u < 635; ++u) ASSERT_EQ(found.at(u, v), 6170);
}

TEST(DepthRegistration, OneLensAndPlaceOnlyChangesTheUnit) {
  CameraRig made;
  made.colour.pinhole = smallCamera();
  made.depth_units_per_m = 1000;
  DepthImage values(320, 240);
  for (size_t i = 0; i < values.size(); ++i) values.data()[i] = static_cast<uint16_t>(i);
  DepthRegistration registration(made, made.colour.pinhole, true);
  const DepthImage found = registration.apply(values);
  for (size_t i = 0; i < values.size(); ++i)
    ASSERT_EQ(found.data()[i], 5 * (i & 0xffff) <= 65535 ? 5 * (i & 0xffff) : 0);
}

TEST(DepthRegistration, ValuesThatCannotBeDoNoHarm) {
  CameraRig made = rig();
  made.depth.k1 = -3;  // most of its rays do not exist
  made.T_colour_depth = Pose(Eigen::Quaterniond(Eigen::AngleAxisd(3, Eigen::Vector3d::UnitY())), {1, 1, -1});
  DepthRegistration registration(made, made.colour.pinhole.shrunk(4), false);
  for (const uint16_t value : {uint16_t{1}, uint16_t{1000}, uint16_t{65535}})
    EXPECT_EQ(registration.apply(DepthImage(320, 240, value)).width(), 80);
}

}  // namespace
}  // namespace comap
