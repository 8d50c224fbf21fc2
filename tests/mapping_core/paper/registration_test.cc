// What the paper mode's registration lets count: brightness where depths agree, and both kinds in the covariance.
#include "mapping_core/paper/registration.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/scenes/scene.h"

namespace comap {
namespace {

constexpr double kDepth_m = 1.0;

// A picture full of slopes in both directions; `shift_px` moves it to the right.
Rgb textureAt(double x, double y) {
  const double grey = 128 + 50 * std::sin(x / 4) + 50 * std::sin(y / 5 + 0.7 * std::sin(x / 31));
  const auto byte = static_cast<uint8_t>(std::lround(grey));
  return {byte, byte, byte};
}

// A wall straight ahead; its right third lies `behind_m` farther off, with the picture on it moved by `shift_px`.
Pyramid wall(bool textured, double behind_m = 0, double shift_px = 0) {
  const CameraModel camera = smallCamera();
  ColourImage colour(camera.width, camera.height, Rgb{128, 128, 128});
  DepthImage depth(camera.width, camera.height, 0);
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const bool right = x >= camera.width * 2 / 3;
      if (textured) colour.at(x, y) = textureAt(right ? x - shift_px : x, y);
      depth.at(x, y) = static_cast<uint16_t>(std::lround((kDepth_m + (right ? behind_m : 0)) * kDepthUnitsPerMetre));
    }
  Pyramid pyramid;
  buildPyramid(colour, depth, camera, kDenseLevels, 0.3f, 5.0f, pyramid);
  return pyramid;
}

TEST(Registration, ThePictureOnAWallHoldsTheCameraWhereItsShapeDoesNot) {
  PaperOptions options;
  options.fixes.joint_covariance = true;
  Registrar registrar(options);
  const Pyramid textured = wall(true), plain = wall(false);
  const CameraModel camera = smallCamera();
  const auto held = registrar.registerViews(textured, textured);
  ASSERT_TRUE(held);
  EXPECT_TRUE(passes(held->fit, options.closure, camera, false)) << held->fit.worst_variance;
  // The same view by its shape alone: along the wall all is open.
  const auto shape = Registrar(PaperOptions()).registerViews(textured, textured);
  ASSERT_TRUE(shape);
  EXPECT_EQ(shape->fit.inliers, held->fit.inliers);
  EXPECT_FALSE(passes(shape->fit, options.closure, camera, false));
  const auto open = registrar.registerViews(plain, plain);
  EXPECT_TRUE(!open || !passes(open->fit, options.closure, camera, false)) << "nothing holds it along a bare wall";
}

TEST(Registration, IndependentGatesDoNotGrowLooserWithTheOverlap) {
  const PaperOptions options;
  const CameraModel camera = smallCamera();
  const double pixels = static_cast<double>(camera.width) * camera.height;
  Fit fit;
  fit.worst_variance = 0;
  fit.compared = static_cast<size_t>(0.9 * pixels);
  fit.inliers = static_cast<size_t>(0.8 * pixels);
  const auto leave = [&](double rms_m) {
    fit.rms_m = rms_m;
    fit.error = rms_m / std::sqrt(static_cast<double>(fit.inliers));
  };
  leave(0.02);
  EXPECT_TRUE(passes(fit, options.closure, camera, false)) << "2 cm are let pass where views overlap much";
  EXPECT_FALSE(passes(fit, options.closure, camera, true));
  leave(0.01);
  EXPECT_TRUE(passes(fit, options.closure, camera, true));
  // Little of what both see fits, and that little well.
  fit.inliers = static_cast<size_t>(0.3 * pixels);
  leave(0.002);
  EXPECT_TRUE(passes(fit, options.closure, camera, false));
  EXPECT_FALSE(passes(fit, options.closure, camera, true));
}

TEST(Registration, BrightnessIsNotComparedBetweenSurfacesTwelveCentimetresApart) {
  const Pyramid reference = wall(true), frame = wall(true, 0.12, 3);
  const auto shiftOf = [&](double gate_m) {
    PaperOptions options;
    options.dense.brightness_gate_m = gate_m;
    const Alignment found = Registrar(options).align(reference, frame, Pose());
    EXPECT_TRUE(found.solved);
    return std::abs(found.T_ref_cur.translation().x());
  };
  EXPECT_LT(shiftOf(PaperOptions().dense.brightness_gate_m), 0.0005);
  EXPECT_GT(shiftOf(0.16), 0.002) << "a gate as wide as that lets another surface pull";
}

TEST(Registration, DepthWeighsAlikeWhateverTheDistanceUnlessNoiseIsAskedFor) {
  // A board of fields at 1 and at 4 m: those near say that nothing has moved, those far that they are 3 cm nearer.
  const CameraModel camera = smallCamera();
  const auto board = [&](double far_m) {
    constexpr int kField_px = 40;
    DepthImage depth(camera.width, camera.height, 0);
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x) {
        const bool far = (x / kField_px + y / kField_px) % 2 == 1;
        depth.at(x, y) = static_cast<uint16_t>(std::lround((far ? far_m : kDepth_m) * kDepthUnitsPerMetre));
      }
    Pyramid pyramid;
    buildPyramid(ColourImage(camera.width, camera.height, Rgb{128, 128, 128}), depth, camera, kDenseLevels, 0.3f, 5.0f,
                 pyramid);
    return pyramid;
  };
  const Pyramid reference = board(4), frame = board(3.97);
  const auto forward = [&](bool noise_weights) {
    PaperOptions options;
    options.fixes.noise_weights = noise_weights;
    const Alignment found = Registrar(options).align(reference, frame, Pose());
    EXPECT_TRUE(found.solved);
    return std::abs(found.T_ref_cur.translation().z());
  };
  EXPECT_NEAR(forward(false), 0.015, 0.003) << "half of the points each";
  EXPECT_LT(forward(true), 0.002) << "what is near is measured better";
}

}  // namespace
}  // namespace comap
