// The map cut into cubes, as it goes to robots and into the store.
#pragma once

#include <compare>
#include <cstdint>
#include <vector>

#include "protocol/types/fern_code.h"
#include "protocol/types/ids.h"
#include "protocol/types/pose.h"

namespace comap {

inline constexpr float kTileEdge_m = 0.5f;

/// Cube [x, x+1) * kTileEdge_m etc. in the frame of map `map`.
struct TileKey {
  MapId map;
  int32_t x = 0, y = 0, z = 0;
  auto operator<=>(const TileKey&) const = default;
};

/// One quantised surfel, 14 bytes on the wire; see tile_quantisation.h for the way back to metres.
struct TileSurfel {
  uint16_t x = 0, y = 0, z = 0;  ///< position in the tile, 65536 steps an edge
  uint8_t normal_u = 0, normal_v = 0;  ///< octahedral
  uint8_t r = 0, g = 0, b = 0;
  uint8_t log_radius = 0;   ///< radius = 0.5 mm * 1.03^log_radius
  uint8_t confidence = 0;   ///< fused measurement weight, saturated
  uint8_t contributors = 0;  ///< bit per robot, in the order of first arrival at the core
  bool operator==(const TileSurfel&) const = default;
};

/// A view that some robot had from within the cube. What another one sees can be compared with its code, and, if that
/// is like it, with the surfels as seen from its pose.
struct TilePlace {
  Pose T_map_cam;
  FernCode code;
  bool operator==(const TilePlace& other) const {
    return T_map_cam.translation() == other.T_map_cam.translation() &&
           T_map_cam.rotation().coeffs() == other.T_map_cam.rotation().coeffs() && code == other.code;
  }
};

/// A tile at one revision.
struct Tile {
  TileKey key;
  uint64_t revision = 0;
  std::vector<TileSurfel> surfels = {};
  std::vector<TilePlace> places = {};
  bool empty() const { return surfels.empty() && places.empty(); }  ///< means: removed
  bool operator==(const Tile&) const = default;
};

}  // namespace comap
