#include "tests/scenes/scene_tiles.h"

#include <array>
#include <cmath>
#include <map>
#include <set>

#include "mapping_core/ferns/fern_encoder.h"
#include "protocol/types/tile_quantisation.h"

namespace comap {
namespace {

constexpr double kSpacing_m = 0.01, kJump_m = 0.05;
constexpr uint8_t kConfidence = 20;

TileKey keyAt(const MapId& map, const Eigen::Vector3d& x) {
  const auto cell = [](double v) { return static_cast<int32_t>(std::floor(v / double{kTileEdge_m})); };
  return {map, cell(x.x()), cell(x.y()), cell(x.z())};
}

}  // namespace

std::vector<Tile> sceneTiles(const Scene& scene, const std::vector<Pose>& T_world_cams, const MapId& map,
                             uint64_t revision) {
  static const FernBook kBook = FernBook::standard();
  const CameraModel camera = smallCamera();
  std::map<TileKey, Tile> tiles;
  std::set<std::array<int, 3>> taken;
  for (const Pose& T_world_cam : T_world_cams) {
    const Frame frame = scene.render(camera, T_world_cam);
    const auto at = [&](int u, int v) { return camera.unproject(u, v, frame.depth.at(u, v) / kDepthUnitsPerMetre); };
    for (int v = 1; v + 1 < camera.height; ++v)
      for (int u = 1; u + 1 < camera.width; ++u) {
        if (frame.depth.at(u, v) == 0) continue;
        const Eigen::Vector3d p = at(u, v), across = at(u + 1, v) - at(u - 1, v), down = at(u, v + 1) - at(u, v - 1);
        if (across.norm() > kJump_m || down.norm() > kJump_m) continue;
        const Eigen::Vector3d x = T_world_cam * p;
        const auto cube = [](double c) { return static_cast<int>(std::floor(c / kSpacing_m)); };
        if (!taken.insert({cube(x.x()), cube(x.y()), cube(x.z())}).second) continue;
        const Eigen::Vector3d n = T_world_cam.rotation() * down.cross(across).normalized();
        const TileKey key = keyAt(map, x);
        TileSurfel surfel;
        quantiseDisc({x.cast<float>(), n.cast<float>(), 0.005f}, key, surfel);
        const Rgb colour = frame.colour.at(u, v);
        surfel.r = colour.r;
        surfel.g = colour.g;
        surfel.b = colour.b;
        surfel.confidence = kConfidence;
        tiles[key].surfels.push_back(surfel);
      }
    tiles[keyAt(map, T_world_cam.translation())].places.push_back(
        {T_world_cam, encodeFerns(kBook, frame.colour, frame.depth)});
  }
  std::vector<Tile> result;
  for (auto& [key, tile] : tiles) {
    tile.key = key;
    tile.revision = revision;
    result.push_back(std::move(tile));
  }
  return result;
}

}  // namespace comap
