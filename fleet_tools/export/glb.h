// Point clouds as binary glTF 2.0, which browsers, Blender and 3D Tiles viewers open.
#pragma once

#include <Eigen/Geometry>
#include <span>
#include <string>

#include "fleet_tools/export/ply.h"
#include "protocol/types/result.h"

namespace comap {

/// How a point cloud is written; the numbers in the file stay those of the map's frame.
struct GlbOptions {
  /// Of the node that holds the points: turns the map's frame into the file's, whose y is up.
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  std::string name = "map";
};

/// One mesh of points: POSITION and NORMAL as floats, COLOR_0 as RGBA bytes, and, named as applications' own attributes
/// are, _RADIUS (metres) and _CONFIDENCE. kUnreachable if it cannot be written, kProblem if there are no points or more
/// than a file of 4 GB holds.
Result<void> writeGlb(const std::string& path, std::span<const MapPoint> points, const GlbOptions& options);

}  // namespace comap
