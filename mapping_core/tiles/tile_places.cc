#include "mapping_core/tiles/tile_places.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace comap {
namespace {

constexpr double kMaxPosition_m = 5e5;

bool near(const Pose& a, const Pose& b, double distance_m, double angle_rad) {
  const Pose between = a.inverse() * b;
  return between.translation().norm() < distance_m && between.angle() < angle_rad;
}

TileKey keyAt(const MapId& map, const Eigen::Vector3d& position_m) {
  const auto cell = [](double v) { return static_cast<int32_t>(std::floor(v / double{kTileEdge_m})); };
  return {map, cell(position_m.x()), cell(position_m.y()), cell(position_m.z())};
}

// The pose that robots have of this view already, if it is still good.
Pose settled(const TilePlace& view, const std::vector<TilePlace>& known, const PlaceOptions& options) {
  for (const TilePlace& place : known)
    if (near(place.T_map_cam, view.T_map_cam, options.still_m, options.still_rad) && place.code == view.code)
      return place.T_map_cam;
  return view.T_map_cam;
}

// The places of each cube.
std::map<TileKey, std::vector<TilePlace>> choose(const MapId& map, std::span<const TilePlace> views,
                                                 const TileIndex& current, const PlaceOptions& options) {
  std::map<TileKey, std::vector<TilePlace>> chosen;
  for (const TilePlace& view : views) {
    const Eigen::Vector3d& at = view.T_map_cam.translation();
    if (view.code.codes.empty() || !(at.cwiseAbs().maxCoeff() < kMaxPosition_m)) continue;
    const TileKey key = keyAt(map, at);
    std::vector<TilePlace>& places = chosen[key];
    const bool redundant = std::any_of(places.begin(), places.end(), [&](const TilePlace& place) {
      return near(place.T_map_cam, view.T_map_cam, options.apart_m, options.apart_rad);
    });
    if (redundant || places.size() >= options.most_per_tile) continue;
    const Tile* before = current.find(key);
    places.push_back({before == nullptr ? view.T_map_cam : settled(view, before->places, options), view.code});
  }
  return chosen;
}

}  // namespace

void addPlaces(const MapId& map, std::span<const TilePlace> views, const TileIndex& current,
               const PlaceOptions& options, std::vector<Tile>& tiles) {
  auto chosen = choose(map, views, current, options);
  for (const auto& [key, tile] : current.of(map))
    if (!tile.places.empty()) chosen.try_emplace(key);  // which has none any more
  for (Tile& tile : tiles)
    if (auto places = chosen.extract(tile.key)) tile.places = std::move(places.mapped());
  for (auto& [key, places] : chosen) {
    const Tile* before = current.find(key);
    if (before != nullptr && before->places == places) continue;
    Tile& tile = tiles.emplace_back();
    if (before != nullptr) tile.surfels = before->surfels;
    tile.key = key;
    tile.places = std::move(places);
  }
}

}  // namespace comap
