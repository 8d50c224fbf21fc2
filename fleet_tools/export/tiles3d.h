// A map as 3D Tiles 1.1: a tileset of binary glTF that viewers such as Cesium load as they need it.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <span>

#include "fleet_tools/export/staged_files.h"
#include "protocol/types/tile.h"

namespace comap {

struct Tiles3dResult {
  size_t contents = 0;  ///< GLB files
  size_t points = 0;    ///< surfels in the finest of them: each once
};

/// Writes tileset.json and, in folders beside it, the contents: `tiles/`, a GLB for each map tile with all its surfels;
/// `blocks/`, thinned, for each cube of 8 tiles a side; and `map.glb`, thinned further, for all. A tile replaces its
/// parent (refine REPLACE). Coordinates are the map's; the root's transform turns `up` into z. The geometric error of a
/// thinned content is the farthest that a surfel which was left out can be from one that was kept.
/// kProblem if there are no surfels; errors of writing as StagedFiles.
Result<Tiles3dResult> writeTiles3d(StagedFiles& files, const std::filesystem::path& folder, std::span<const Tile> tiles,
                                   const Eigen::Vector3d& up);

}  // namespace comap
