#include "fleet_tools/export/tiles3d.h"

#include <Eigen/Geometry>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <ranges>

#include "fleet_tools/export/glb.h"
#include "fleet_tools/export/map_points.h"

namespace comap {
namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;

constexpr int kBlockTiles = 8;  // a side
constexpr double kBlockSpacing_m = 0.05, kMapSpacing_m = 0.2;

// Viewers turn glTF's y into their z, (x, y, z) to (x, -z, y); the node undoes that, so that contents are in the map's
// frame as the tileset's boxes are.
const Eigen::Quaterniond kAgainstYUp(Eigen::AngleAxisd(-std::numbers::pi / 2, Eigen::Vector3d::UnitX()));

// The most confident of each cube; the cube's diagonal bounds how far any is from it. Discs grow to cover the cube.
std::vector<MapPoint> thinned(std::span<const MapPoint> points, double spacing_m) {
  std::map<std::tuple<int64_t, int64_t, int64_t>, const MapPoint*> kept;
  for (const MapPoint& point : points) {
    const auto cell = [&](int axis) { return static_cast<int64_t>(std::floor(point.position[axis] / spacing_m)); };
    const MapPoint*& best = kept[{cell(0), cell(1), cell(2)}];
    if (best == nullptr || point.confidence > best->confidence) best = &point;
  }
  std::vector<MapPoint> few;
  few.reserve(kept.size());
  for (const auto& [cell, point] : kept) {
    few.push_back(*point);
    few.back().radius = std::max(point->radius, static_cast<float>(spacing_m / 2));
  }
  return few;
}

double errorOf(double spacing_m) { return spacing_m * std::numbers::sqrt3; }

// A box around discs, radii included.
struct Bounds {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e30), high = Eigen::Vector3d::Constant(-1e30);
  void add(std::span<const MapPoint> points) {
    for (const MapPoint& point : points) {
      const Eigen::Vector3d at = point.position.cast<double>();
      low = low.cwiseMin((at.array() - double{point.radius}).matrix());
      high = high.cwiseMax((at.array() + double{point.radius}).matrix());
    }
  }
  void add(const Bounds& other) {
    low = low.cwiseMin(other.low);
    high = high.cwiseMax(other.high);
  }
  Json json() const {
    const Eigen::Vector3d c = (low + high) / 2, h = (high - low) / 2;
    return {{"box", {c.x(), c.y(), c.z(), h.x(), 0, 0, 0, h.y(), 0, 0, 0, h.z()}}};
  }
  double diagonal() const { return (high - low).norm(); }
};

struct Block {
  std::vector<MapPoint> points;  // thinned
  Bounds bounds;
  Json children = Json::array();
};

std::string nameOf(const std::array<int32_t, 3>& at) {
  return std::to_string(at[0]) + "_" + std::to_string(at[1]) + "_" + std::to_string(at[2]) + ".glb";
}

int32_t blockOf(int32_t tile) { return static_cast<int32_t>(std::floor(static_cast<double>(tile) / kBlockTiles)); }

// Column by column, as the tileset has it.
Json transformOf(const Eigen::Vector3d& up) {
  const Eigen::Matrix3d R = Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  Json values = Json::array();
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 3; ++row) values.push_back(R(row, column));
    values.push_back(0);
  }
  for (const int value : {0, 0, 0, 1}) values.push_back(value);
  return values;
}

}  // namespace

Result<Tiles3dResult> writeTiles3d(StagedFiles& files, const fs::path& folder, std::span<const Tile> tiles,
                                   const Eigen::Vector3d& up) {
  for (const fs::path& made : {folder, folder / "tiles", folder / "blocks"})
    if (const auto there = files.makeFolder(made); !there) return there.error();
  GlbOptions options;
  options.rotation = kAgainstYUp;
  Tiles3dResult result;
  const auto write = [&](const fs::path& file, std::span<const MapPoint> points) {
    ++result.contents;
    options.name = file.stem().string();
    return writeGlb(files.stage(folder / file), points, options);
  };

  std::map<std::array<int32_t, 3>, Block> blocks;
  for (const Tile& tile : tiles) {
    if (tile.surfels.empty()) continue;
    const std::vector<MapPoint> points = pointsOf(tile);
    const fs::path file = fs::path("tiles") / nameOf({tile.key.x, tile.key.y, tile.key.z});
    if (const auto written = write(file, points); !written) return written.error();
    result.points += points.size();
    Bounds bounds;
    bounds.add(points);
    Block& block = blocks[{blockOf(tile.key.x), blockOf(tile.key.y), blockOf(tile.key.z)}];
    const std::vector<MapPoint> few = thinned(points, kBlockSpacing_m);
    block.points.insert(block.points.end(), few.begin(), few.end());
    block.bounds.add(bounds);
    block.bounds.add(few);
    block.children.push_back(
        {{"boundingVolume", bounds.json()}, {"geometricError", 0}, {"content", {{"uri", file.generic_string()}}}});
  }
  if (blocks.empty()) return Error{ErrorCode::kProblem, folder.string() + ": the map holds no surfels"};

  Json children = Json::array();
  std::vector<MapPoint> all;
  Bounds bounds;
  for (Block& block : blocks | std::views::values) bounds.add(block.bounds);
  for (auto& [at, block] : blocks) {
    const fs::path file = fs::path("blocks") / nameOf(at);
    if (const auto written = write(file, block.points); !written) return written.error();
    all.insert(all.end(), block.points.begin(), block.points.end());
    children.push_back({{"boundingVolume", block.bounds.json()},
                        {"geometricError", errorOf(kBlockSpacing_m)},
                        {"refine", "REPLACE"},
                        {"content", {{"uri", file.generic_string()}}},
                        {"children", std::move(block.children)}});
  }
  // What is thinned twice is off by both.
  const double map_error = errorOf(kMapSpacing_m) + errorOf(kBlockSpacing_m);
  all = thinned(all, kMapSpacing_m);
  bounds.add(all);
  if (const auto written = write("map.glb", all); !written) return written.error();
  const Json tileset = {{"asset", {{"version", "1.1"}, {"generator", "CoMap " COMAP_VERSION}}},
                        {"geometricError", std::max(bounds.diagonal(), 2 * map_error)},
                        {"root",
                         {{"boundingVolume", bounds.json()},
                          {"geometricError", map_error},
                          {"refine", "REPLACE"},
                          {"transform", transformOf(up)},
                          {"content", {{"uri", "map.glb"}}},
                          {"children", std::move(children)}}}};
  const fs::path file = folder / "tileset.json";
  std::ofstream out(files.stage(file));
  out << tileset.dump(1) << "\n";
  out.flush();
  if (!out) return Error{ErrorCode::kUnreachable, file.string() + ": cannot be written"};
  return result;
}

}  // namespace comap
