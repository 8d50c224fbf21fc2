#include "mapping_core/rgbd/reference_view.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/scenes/scene.h"

namespace comap {
namespace {

Pyramid pyramidOf(const Scene& scene, const CameraModel& camera) {
  const Frame frame = scene.render(camera, Pose());
  Pyramid pyramid;
  buildPyramid(frame.colour, frame.depth, camera, 4, 0.3f, 6, pyramid);
  return pyramid;
}

void expectSamePoints(const ReferencePoints& a, const ReferencePoints& b) {
  EXPECT_EQ(a.count, b.count);
  EXPECT_EQ(a.x, b.x);
  EXPECT_EQ(a.y, b.y);
  EXPECT_EQ(a.z, b.z);
  EXPECT_EQ(a.nx, b.nx);
  EXPECT_EQ(a.grey, b.grey);
  EXPECT_EQ(a.sigma_m, b.sigma_m);
}

TEST(ReferenceView, levelsComeCoarsestFirstAndWithinTheLimit) {
  const ReferenceOptions options;
  const ReferenceView view = buildReference(pyramidOf(Scene::room(), kinectCamera()), options, {});
  ASSERT_EQ(view.levels.size(), 3u);
  for (size_t i = 0; i < 3; ++i) {
    const ReferencePoints& points = view.levels[i];
    EXPECT_EQ(points.level, 3 - static_cast<int>(i));
    EXPECT_LE(points.count, static_cast<size_t>(options.max_points));
    EXPECT_GT(points.count, static_cast<size_t>(options.max_points) / 2);
    EXPECT_EQ(points.x.size() % 8, 0u);
    for (const auto* column : {&points.y, &points.z, &points.nx, &points.ny, &points.nz, &points.grey, &points.sigma_m})
      EXPECT_EQ(column->size(), points.x.size());
  }
}

TEST(ReferenceView, normalsOfAPlaneAreThePlanes) {
  const Eigen::Vector3d normal = Eigen::Vector3d(0.5, -0.2, -0.84).normalized();
  for (const double fy : {525.0, -525.0}) {
    CameraModel camera = kinectCamera();
    camera.fy = fy;
    const ReferenceView view = buildReference(pyramidOf(Scene::plainPlane({0, 0, 2}, normal), camera), {}, {});
    for (const ReferencePoints& points : view.levels) {
      size_t with_normal = 0;
      for (size_t i = 0; i < points.count; ++i) {
        const Eigen::Vector3d p(points.x[i], points.y[i], points.z[i]);
        EXPECT_NEAR(normal.dot(p - Eigen::Vector3d(0, 0, 2)), 0, 1e-3);
        const Eigen::Vector3d n(points.nx[i], points.ny[i], points.nz[i]);
        if (n.isZero()) continue;
        ++with_normal;
        EXPECT_NEAR(n.norm(), 1, 1e-5);
        EXPECT_LT(n.dot(p), 0) << "normals face the camera, fy " << fy;
        EXPECT_GT(n.dot(normal), std::cos(1.0 * M_PI / 180));
      }
      EXPECT_GT(with_normal, points.count * 9 / 10);
    }
  }
}

TEST(ReferenceView, sigmaIsThatOfTheModelAlongTheNormal) {
  const DepthNoiseModel noise;
  const ReferenceView view =
      buildReference(pyramidOf(Scene::plainPlane({0, 0, 2}, {0, 0, -1}), kinectCamera()), {}, noise);
  const ReferencePoints& points = view.levels.back();
  for (size_t i = 0; i < points.count; ++i) {
    const double cosine = 2 / Eigen::Vector3d(points.x[i], points.y[i], points.z[i]).norm();
    EXPECT_NEAR(points.sigma_m[i], cosine * noise.sigma(2), 1e-5);
  }
}

TEST(ReferenceView, noNormalAcrossAnEdge) {
  Pyramid pyramid = pyramidOf(Scene::plainPlane({0, 0, 2}, {0, 0, -1}), kinectCamera());
  Image<float>& depth = pyramid[1].depth_m;
  for (int y = 0; y < depth.height(); ++y)
    for (int x = depth.width() / 2; x < depth.width(); ++x) depth.at(x, y) = 3;
  const ReferenceView view = buildReference(pyramid, {1, 1, 320 * 240}, {});
  const double edge_px = depth.width() / 2 - 0.5;
  for (const ReferencePoints& points : view.levels)
    for (size_t i = 0; i < points.count; ++i) {
      const double u = points.x[i] / points.z[i] * points.camera.fx + points.camera.cx;
      const bool has_normal = points.nz[i] != 0;
      if (std::abs(u - edge_px) < 2) {
        EXPECT_FALSE(has_normal) << u;
      } else if (std::abs(u - edge_px) > 3 && u > 3 && u < depth.width() - 4 && points.z[i] < 2.5f) {
        EXPECT_NEAR(points.nz[i], -1, 1e-4) << u;
      }
    }
}

TEST(ReferenceView, theSameFrameGivesTheSamePoints) {
  const Pyramid pyramid = pyramidOf(Scene::room(), smallCamera());
  const ReferenceView a = buildReference(pyramid, {}, {}), b = buildReference(pyramid, {}, {});
  ASSERT_EQ(a.levels.size(), b.levels.size());
  for (size_t l = 0; l < a.levels.size(); ++l) expectSamePoints(a.levels[l], b.levels[l]);
}

TEST(ReferenceView, aFrameWithoutDepthHasNoPoints) {
  Pyramid pyramid;
  buildPyramid(ColourImage(320, 240), DepthImage(320, 240), smallCamera(), 4, 0.3f, 6, pyramid);
  for (const ReferencePoints& points : buildReference(pyramid, {}, {}).levels) EXPECT_EQ(points.count, 0u);
}

}  // namespace
}  // namespace comap
