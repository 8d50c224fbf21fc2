#include "edge_agent/capture/camera_rig.h"

#include <gtest/gtest.h>

#include "edge_agent/capture/undistort.h"
#include "tests/scenes/scene.h"

namespace comap {
namespace {

Lens bent() {
  Lens lens;
  lens.pinhole = {300, 302, 158, 121, 320, 240};
  lens.k1 = 0.12;
  lens.k2 = -0.25;
  lens.p1 = 0.002;
  lens.p2 = -0.0015;
  lens.k3 = 0.05;
  return lens;
}

TEST(Lens, IsBrownAndConrady) {
  const Lens lens = bent();
  const double x = 0.3, y = -0.2, r2 = x * x + y * y;
  const double radial = 1 + lens.k1 * r2 + lens.k2 * r2 * r2 + lens.k3 * r2 * r2 * r2;
  const double x2 = x * radial + 2 * lens.p1 * x * y + lens.p2 * (r2 + 2 * x * x);
  const double y2 = y * radial + lens.p1 * (r2 + 2 * y * y) + 2 * lens.p2 * x * y;
  const Eigen::Vector2d pixel = lens.pixelOf(x, y);
  EXPECT_NEAR(pixel.x(), 300 * x2 + 158, 1e-9);
  EXPECT_NEAR(pixel.y(), 302 * y2 + 121, 1e-9);
}

TEST(Lens, RayOfUndoesPixelOf) {
  const Lens lens = bent();
  for (int v = -1; v <= 240; v += 7) {
    for (int u = -1; u <= 320; u += 7) {
      const auto ray = lens.rayOf(u, v);
      ASSERT_TRUE(ray) << u << " " << v;
      const Eigen::Vector2d back = lens.pixelOf(ray->x(), ray->y());
      ASSERT_NEAR(back.x(), u, 1e-6);
      ASSERT_NEAR(back.y(), v, 1e-6);
    }
  }
}

TEST(Lens, ADistortionThatCannotBeUndoneGivesNoRay) {
  Lens lens = bent();
  lens.k1 = -2;  // folds at r = 0.41
  lens.k2 = lens.k3 = 0;
  EXPECT_TRUE(lens.rayOf(160, 120));
  EXPECT_FALSE(lens.rayOf(0, 0));
}

// A picture taken through the lens, pixel by pixel from the scene, becomes the one that a pinhole takes.
TEST(Undistorter, GivesWhatAPinholeSees) {
  const Lens lens = bent();
  const Scene scene = Scene::room();
  // Through a larger pinhole all of the lens' pixels can be looked up.
  CameraModel large = lens.pinhole;
  large.width = 1600;
  large.height = 1200;
  large.fx = large.fy = 1200;
  large.cx = 800;
  large.cy = 600;
  const Frame wide = scene.render(large, Pose());
  ColourImage taken(320, 240);
  for (int v = 0; v < 240; ++v) {
    for (int u = 0; u < 320; ++u) {
      const Eigen::Vector2d ray = lens.rayOf(u, v).value();
      taken.at(u, v) = wide.colour.at(static_cast<int>(std::lround(1200 * ray.x() + 800)),
                                      static_cast<int>(std::lround(1200 * ray.y() + 600)));
    }
  }
  const ColourImage straight = Undistorter(lens).apply(taken);
  const Frame wanted = scene.render(lens.pinhole, Pose());
  double before = 0, after = 0;
  int count = 0;
  for (int v = 10; v < 230; ++v) {
    for (int u = 10; u < 310; ++u) {
      if (straight.at(u, v) == Rgb{}) continue;
      before += std::abs(taken.at(u, v).g - wanted.colour.at(u, v).g);
      after += std::abs(straight.at(u, v).g - wanted.colour.at(u, v).g);
      ++count;
    }
  }
  EXPECT_GT(count, 60000);
  EXPECT_LT(after / count, 0.8);
  EXPECT_GT(before, 4 * after);
}

// The table's fixed-point weights against bilinear interpolation in real arithmetic.
TEST(Undistorter, InterpolatesWithinARoundingStep) {
  const Lens lens = bent();
  const Frame frame = Scene::room(3).render(lens.pinhole, Pose());
  const ColourImage made = Undistorter(lens).apply(frame.colour);
  for (int v = 0; v < 240; ++v) {
    for (int u = 0; u < 320; ++u) {
      const Eigen::Vector2d at =
          lens.pixelOf((u - lens.pinhole.cx) / lens.pinhole.fx, (v - lens.pinhole.cy) / lens.pinhole.fy);
      if (at.x() < 0 || at.y() < 0 || at.x() >= 319 || at.y() >= 239) continue;
      const int x = static_cast<int>(at.x()), y = static_cast<int>(at.y());
      const double a = at.x() - x, b = at.y() - y;
      const auto g = [&](int i, int j) { return static_cast<double>(frame.colour.at(x + i, y + j).g); };
      const double wanted = (1 - b) * ((1 - a) * g(0, 0) + a * g(1, 0)) + b * ((1 - a) * g(0, 1) + a * g(1, 1));
      ASSERT_NEAR(made.at(u, v).g, wanted, 0.5 + 255.0 / 256);
    }
  }
}

TEST(Undistorter, AStraightLensChangesNothing) {
  Lens lens;
  lens.pinhole = smallCamera();
  const Frame frame = Scene::room().render(lens.pinhole, Pose());
  EXPECT_EQ(Undistorter(lens).apply(frame.colour), frame.colour);
}

TEST(CameraRig, ResizesWithTheView) {
  Lens lens;
  lens.pinhole = {600, 600, 319.5, 239.5, 640, 480};
  const auto half = resized(lens, 320, 240);
  ASSERT_TRUE(half);
  EXPECT_EQ(half->pinhole, lens.pinhole.shrunk(2));
  EXPECT_FALSE(resized(lens, 640, 400));
}

TEST(CameraRig, ProfilesAreSane) {
  EXPECT_GE(cameraProfiles().size(), 4u);
  for (const CameraProfile& profile : cameraProfiles()) {
    for (const Lens* lens : {&profile.rig.colour, &profile.rig.depth}) {
      EXPECT_GT(lens->pinhole.fx, 300) << profile.name;
      EXPECT_LT(lens->pinhole.fx, 700) << profile.name;
      EXPECT_EQ(lens->pinhole.width, 640);
    }
    EXPECT_LT(profile.rig.T_colour_depth.translation().norm(), 0.06) << profile.name;
    EXPECT_GT(profile.noise_factor_per_m, 0.001f) << profile.name;
  }
}

}  // namespace
}  // namespace comap
