#include "fleet_tools/synth/scene.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "fleet_tools/synth/scene_bvh.h"
#include "fleet_tools/synth/scene_surface.h"
#include "fleet_tools/synth/synth_path.h"
#include "fleet_tools/synth/synth_renderer.h"

namespace comap {
namespace {

using Eigen::Vector3f;

TEST(SceneShape, RaysEnterWhereGeometrySays) {
  const float never = std::numeric_limits<float>::infinity();
  EXPECT_FLOAT_EQ(enter(Shape::kBox, {1, 2, 3}, {-5, 0, 0}, {2, 0, 0.1f}), 2);
  EXPECT_EQ(enter(Shape::kBox, {1, 2, 3}, {-5, 2.5f, 0}, {1, 0.001f, 0.001f}), never);
  EXPECT_EQ(enter(Shape::kBox, {1, 2, 3}, {-5, 0, 0}, {-1, 0.001f, 0.001f}), never) << "behind";
  EXPECT_EQ(enter(Shape::kBox, {1, 2, 3}, {0, 0, 0}, {1, 0.1f, 0.1f}), never) << "from inside";
  EXPECT_FLOAT_EQ(enter(Shape::kEllipsoid, {1, 2, 3}, {0, -10, 0}, {0, 1, 0}), 8);
  EXPECT_FLOAT_EQ(enter(Shape::kCylinder, {0.5f, 0.5f, 1}, {-3, 0, 0.5f}, {1, 0, 0.01f}), 2.5f);
  EXPECT_FLOAT_EQ(enter(Shape::kCylinder, {0.5f, 0.5f, 1}, {0.1f, 0.2f, 5}, {0, 0, -2}), 2);
  EXPECT_EQ(enter(Shape::kCylinder, {0.5f, 0.5f, 1}, {-3, 0, 1.5f}, {1, 0, 0.01f}), never);
}

TEST(SceneShape, SpotsAndPointsAreInverse) {
  for (const Shape shape : {Shape::kBox, Shape::kEllipsoid, Shape::kCylinder}) {
    Primitive primitive;
    primitive.shape = shape;
    primitive.half = shape == Shape::kCylinder ? Vector3f(0.4f, 0.4f, 1.1f) : Vector3f(0.4f, 0.7f, 1.1f);
    for (int face = 0; face < faceCount(shape); ++face) {
      for (float a = 0.55f; a < 0.7f; a += 0.1f) {
        for (float b = 0.35f; b < 0.7f; b += 0.1f) {
          Vector3f normal;
          const Vector3f point = pointOf(primitive, face, a, b, normal);
          const SurfaceSpot spot = spotAt(primitive, point);
          EXPECT_EQ(spot.face, face);
          EXPECT_NEAR(spot.a, a, 1e-5);
          EXPECT_NEAR(spot.b, b, 1e-5);
          EXPECT_LT((spot.normal_local - normal).norm(), 1e-5);
        }
      }
    }
  }
}

TEST(Scene, UnknownNameListsTheKnown) {
  auto scene = makeScene("castle", 1);
  ASSERT_FALSE(scene);
  EXPECT_EQ(scene.error().code, ErrorCode::kWrongUse);
  for (const auto& info : knownScenes()) EXPECT_NE(scene.error().text.find(info.name), std::string::npos);
}

// Share of pixels whose grey level differs by more than 6 from the pixel two to the right or below.
double textureShare(const ColourImage& image) {
  const auto grey = [&](int x, int y) {
    const Rgb p = image.at(x, y);
    return (p.r + 2 * p.g + p.b) / 4;
  };
  int rich = 0, count = 0;
  for (int y = 0; y + 2 < image.height(); ++y) {
    for (int x = 0; x + 2 < image.width(); ++x, ++count) {
      const int here = grey(x, y);
      rich += std::abs(grey(x + 2, y) - here) > 6 || std::abs(grey(x, y + 2) - here) > 6 ? 1 : 0;
    }
  }
  return static_cast<double>(rich) / count;
}

class SceneByName : public ::testing::TestWithParam<const char*> {};

TEST_P(SceneByName, PictureAgreesWithTracingEachRayAlone) {
  auto scene = makeScene(GetParam(), 3);
  ASSERT_TRUE(scene) << scene.error().text;
  const SynthRenderer renderer(*scene, 2);
  const SceneBvh bvh(scene->primitives);
  const CameraModel camera{131.25, 131.25, 79.5, 59.5, 160, 120};
  const std::string name = GetParam();
  const bool rich = name != "corridor" && name != "blank" && name != "doors";
  for (const auto& route : scene->routes) {
    const auto poses = walkRoute(route, 600, 5);
    for (size_t i = 0; i < poses.size(); i += 150) {
      const auto view = renderer.render(camera, poses[i]);
      const Vector3f origin = poses[i].translation().cast<float>();
      const Eigen::Matrix3f R = poses[i].rotationMatrix().cast<float>();
      int differing = 0;
      for (int y = 0; y < camera.height; ++y) {
        for (int x = 0; x < camera.width; ++x) {
          const auto hit = bvh.trace(origin, R * camera.unproject(x, y, 1).cast<float>());
          ASSERT_GE(hit.primitive, 0) << "rooms are closed";
          // At a rim, one pixel may see past what the next one sees: rounding decides.
          if (std::abs(hit.t - view.depth_m.at(x, y)) > 2e-4f) ++differing;
        }
      }
      EXPECT_LE(differing, 20) << GetParam() << " frame " << i;
      if (rich) {
        EXPECT_GT(textureShare(view.colour), 0.25) << GetParam() << " frame " << i;
      }
    }
  }
}

// The mirrored room is the room: each view of it, mirrored, has the same depth.
TEST(Scene, theMirroredRoomIsTheRoomMirrored) {
  const auto scene = makeScene("mirror", 3);
  ASSERT_TRUE(scene);
  const SynthRenderer renderer(*scene, 2);
  const CameraModel camera{131.25, 131.25, 79.5, 59.5, 160, 120};
  const Eigen::DiagonalMatrix<double, 3> world_flip(-1, 1, 1), camera_flip(-1, 1, 1);
  for (const Pose& pose : walkRoute(scene->routes[0], 7, 5)) {
    Eigen::Vector3d place = pose.translation();
    place.x() = 12 - place.x();
    const Eigen::Matrix3d turn = world_flip * pose.rotationMatrix() * camera_flip;
    const auto view = renderer.render(camera, pose),
               other = renderer.render(camera, Pose(Eigen::Quaterniond(turn), place));
    int differing = 0;
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x)
        differing += std::abs(view.depth_m.at(x, y) - other.depth_m.at(camera.width - 1 - x, y)) > 1e-3f;
    EXPECT_LE(differing, 20);
  }
}

INSTANTIATE_TEST_SUITE_P(All, SceneByName, ::testing::Values("flat", "twins", "mirror", "doors", "blank", "corridor"));

}  // namespace
}  // namespace comap
