#include "fleet_tools/export/tiles3d.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <random>
#include <set>

#include "mapping_core/tiles/tile_builder.h"
#include "tests/files/temporary_folder.h"
#include "tests/fleet_tools/export/glb_reader.h"

namespace comap {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

struct Box {
  Eigen::Vector3d centre, half;
  explicit Box(const Json& volume) {
    const auto v = volume.at("box").get<std::array<double, 12>>();
    centre = {v[0], v[1], v[2]};
    half = {v[3], v[7], v[11]};
    for (const size_t zero : {4, 5, 6, 8, 9, 10}) EXPECT_EQ(v[zero], 0.0);
  }
  double outside(const Eigen::Vector3d& point) const { return ((point - centre).cwiseAbs() - half).maxCoeff(); }
  bool holds(const Box& other) const {
    return ((other.centre - centre).cwiseAbs() + other.half - half).maxCoeff() < 1e-6;
  }
};

// A content's points in the tileset's frame, as a viewer places them: the node's rotation, then glTF's y to z.
std::vector<Eigen::Vector3d> placed(const GlbPoints& glb) {
  std::vector<Eigen::Vector3d> points;
  for (const auto& position : glb.positions) {
    const Eigen::Vector3d p = glb.rotation * position.cast<double>();
    points.emplace_back(p.x(), -p.z(), p.y());
  }
  return points;
}

class Tiles3d : public testing::Test {
 protected:
  void SetUp() override {
    // A floor and a wall, over cubes with negative and positive numbers.
    std::mt19937 random(3);
    std::uniform_real_distribution<float> place(-5.1f, 5.1f);
    std::vector<Surfel> surfels;
    for (int i = 0; i < 6000; ++i) {
      Surfel s;
      s.position = i % 2 ? Eigen::Vector3f(place(random), 0.9f, place(random))
                         : Eigen::Vector3f(place(random), place(random) / 5, 4.9f);
      s.normal = i % 2 ? Eigen::Vector3f(0, -1, 0) : Eigen::Vector3f(0, 0, -1);
      s.radius = 0.01f;
      s.confidence = 2 + static_cast<float>(i % 20);
      surfels.push_back(s);
    }
    tiles_ = buildTiles("a-1-0", surfels, TileOptions{});
  }

  std::vector<Eigen::Vector3d> surfels() const {
    std::vector<Eigen::Vector3d> all;
    for (const Tile& tile : tiles_)
      for (const TileSurfel& s : tile.surfels) all.push_back(dequantise(s, tile.key).position.cast<double>());
    return all;
  }
  GlbPoints content(const Json& tile) {
    const std::string uri = tile.at("content").at("uri").get<std::string>();
    EXPECT_TRUE(used_.insert(uri).second) << uri << " twice";
    return readGlb((folder_ / uri).string());
  }
  // Checks a tile and what is below it; the points of the finest contents come back.
  std::vector<Eigen::Vector3d> check(const Json& tile, double above) {
    const Box box(tile.at("boundingVolume"));
    const double error = tile.at("geometricError").get<double>();
    EXPECT_LE(error, above);
    const GlbPoints glb = content(tile);
    EXPECT_EQ(glb.problem, "");
    const auto own = placed(glb);
    for (size_t i = 0; i < own.size(); ++i) EXPECT_LE(box.outside(own[i]), -double{glb.radii[i]} + 1e-5);
    if (!tile.contains("children")) {
      EXPECT_EQ(error, 0);
      return own;
    }
    EXPECT_EQ(tile.at("refine"), "REPLACE");
    std::vector<Eigen::Vector3d> finest;
    for (const Json& child : tile.at("children")) {
      EXPECT_TRUE(box.holds(Box(child.at("boundingVolume"))));
      const auto below = check(child, error);
      finest.insert(finest.end(), below.begin(), below.end());
    }
    EXPECT_LT(own.size(), finest.size());
    for (const auto& point : finest) {
      double nearest = 1e30;
      for (const auto& kept : own) nearest = std::min(nearest, (kept - point).norm());
      EXPECT_LE(nearest, error);
      if (nearest > error) break;
    }
    return finest;
  }

  const TemporaryFolder temporary_;
  const fs::path folder_ = temporary_.path("tiles");
  std::vector<Tile> tiles_;
  std::set<std::string> used_;
};

TEST_F(Tiles3d, EverySurfelIsInOneOfTheFinestContentsAndBoxesAndErrorsHold) {
  const Eigen::Vector3d up = Eigen::Vector3d(0.1, -1, 0.05).normalized();
  StagedFiles files;
  const auto written = writeTiles3d(files, folder_, tiles_, up);
  ASSERT_TRUE(written) << written.error().text;
  EXPECT_FALSE(fs::exists(folder_ / "tileset.json")) << "not before it is whole";
  ASSERT_TRUE(files.commit());
  std::ifstream file(folder_ / "tileset.json");
  const Json tileset = Json::parse(file);
  EXPECT_EQ(tileset.at("asset").at("version"), "1.1");
  const Json& root = tileset.at("root");
  EXPECT_GT(tileset.at("geometricError").get<double>(), root.at("geometricError").get<double>());

  const auto m = root.at("transform").get<std::array<double, 16>>();
  const Eigen::Vector3d top(m[0] * up.x() + m[4] * up.y() + m[8] * up.z(),
                            m[1] * up.x() + m[5] * up.y() + m[9] * up.z(),
                            m[2] * up.x() + m[6] * up.y() + m[10] * up.z());
  EXPECT_LT((top - Eigen::Vector3d::UnitZ()).norm(), 1e-9);
  EXPECT_EQ(m[15], 1);

  auto finest = check(root, tileset.at("geometricError").get<double>());
  EXPECT_EQ(used_.size(), written->contents);
  auto expected = surfels();
  ASSERT_EQ(finest.size(), expected.size());
  EXPECT_EQ(written->points, expected.size());
  const auto before = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
  };
  // Through the node's rotation and back a coordinate loses its last bits.
  for (auto* list : {&finest, &expected})
    for (auto& point : *list)
      for (double& value : point) value = std::round(value * 1e6);
  std::sort(finest.begin(), finest.end(), before);
  std::sort(expected.begin(), expected.end(), before);
  double worst = 0;
  for (size_t i = 0; i < expected.size(); ++i) worst = std::max(worst, (finest[i] - expected[i]).cwiseAbs().maxCoeff());
  EXPECT_LE(worst, 1) << "micrometres";
  size_t contents = 0;
  for (const Tile& tile : tiles_) contents += !tile.surfels.empty();
  EXPECT_EQ(static_cast<size_t>(std::distance(fs::directory_iterator(folder_ / "tiles"), {})), contents);
}

TEST_F(Tiles3d, AMapWithoutSurfelsLeavesNothingBehind) {
  {
    StagedFiles files;
    EXPECT_FALSE(writeTiles3d(files, folder_, {}, Eigen::Vector3d::UnitZ()));
  }
  EXPECT_FALSE(fs::exists(folder_));
}

}  // namespace
}  // namespace comap
