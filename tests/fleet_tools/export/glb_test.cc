#include "fleet_tools/export/glb.h"

#include <gtest/gtest.h>

#include "tests/files/temporary_folder.h"
#include "tests/fleet_tools/export/glb_reader.h"

namespace comap {
namespace {

TEST(Glb, GivesBackEveryPointAndKeepsTheRulesOfTheFormat) {
  const TemporaryFolder folder;
  for (const size_t count : {size_t{1}, size_t{2}, size_t{777}}) {
    std::vector<MapPoint> points;
    for (size_t i = 0; i < count; ++i) {
      const auto f = static_cast<float>(i);
      points.push_back({{f * 0.1f, -f, 3 - f * f},
                        Eigen::Vector3f(1, f, -2).normalized() * (i % 3 == 0 ? 0.9f : 1.0f),
                        Rgb{uint8_t(i), uint8_t(2 * i), 7},
                        0.001f * f,
                        f / 2});
    }
    const GlbOptions options{Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d(0, -1, 0.1), Eigen::Vector3d::UnitY()),
                             "a-1-0 \xff"};
    const std::string file = folder.path(std::to_string(count));
    ASSERT_TRUE(writeGlb(file, points, options));
    const GlbPoints read = readGlb(file);
    ASSERT_EQ(read.problem, "");
    EXPECT_LT(read.rotation.angularDistance(options.rotation), 1e-6);
    ASSERT_EQ(read.positions.size(), count);
    for (size_t i = 0; i < count; ++i) {
      EXPECT_EQ(read.positions[i], points[i].position);
      EXPECT_GT(read.normals[i].dot(points[i].normal.normalized()), 0.999999f);
      EXPECT_EQ(read.colours[i], (std::array<uint8_t, 4>{points[i].colour.r, points[i].colour.g, 7, 255}));
      EXPECT_EQ(read.radii[i], points[i].radius);
      EXPECT_EQ(read.confidences[i], points[i].confidence);
    }
  }
}

TEST(Glb, RefusesWhatItCannotWrite) {
  const TemporaryFolder folder;
  const MapPoint point;
  EXPECT_EQ(writeGlb(folder.path("none"), {}, {}).error().code, ErrorCode::kProblem);
  EXPECT_EQ(writeGlb("/no/such/folder/map.glb", {&point, 1}, {}).error().code, ErrorCode::kUnreachable);
}

}  // namespace
}  // namespace comap
