// Point clouds on disk in the PLY format, which MeshLab and others open.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "protocol/types/image.h"
#include "protocol/types/result.h"

namespace comap {

/// A surfel for other people's programs.
struct MapPoint {
  Eigen::Vector3f position = Eigen::Vector3f::Zero();  ///< metres, map frame
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
  Rgb colour;
  float radius = 0;  ///< metres
  float confidence = 0;
};

/// Writes binary little-endian PLY: x y z nx ny nz red green blue radius confidence. kUnreachable if it cannot.
Result<void> writePly(const std::string& path, std::span<const MapPoint> points);

struct PlyPoints {
  std::vector<Eigen::Vector3f> positions;  ///< metres
  std::vector<Eigen::Vector3f> normals;    ///< unit or zero; empty if the file has none
  std::vector<float> radii;                ///< metres; empty if the file has none
};

/// Writes positions and float normals only (x y z nx ny nz). `comment` is one line.
Result<void> writePlySurface(const std::string& path, const PlyPoints& points, const std::string& comment);

/// Reads the vertices of an ASCII or binary little-endian PLY: x y z float or double, and nx ny nz as float, double or
/// int8 (divided by 127) and radius as float or double if there. Other scalar properties are skipped, elements after
/// the vertices are not read. kUnreachable: cannot be opened; kBadData: truncated, not finite, not a PLY, or of a kind
/// not read.
Result<PlyPoints> readPly(const std::string& path);

}  // namespace comap
