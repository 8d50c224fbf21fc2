// Pictures of a whole map: where to look from, and how to paint what is seen.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "fleet_tools/render/picture_legend.h"
#include "mapping_core/surfels/surfel_map.h"

namespace comap {

enum class Colouring { kRgb, kNormal, kContribution, kConfidence };

struct PictureView {
  CameraModel camera;
  Pose T_map_cam;
  bool both_sides = true;  ///< false leaves out surfaces seen from behind: near walls and ceilings
};

/// The direction that is up, in the map's frame: from the keyframes' cameras, made exact by floors and tables.
Eigen::Vector3d upDirection(std::span<const Surfel> surfels, std::span<const Pose> T_map_cams);

/// From outside and above, the whole map in the picture, from the side that shows most of it.
PictureView orbitView(std::span<const Surfel> surfels, const Eigen::Vector3d& up, int width, int height);
/// Straight from above, the whole map in the picture.
PictureView topView(std::span<const Surfel> surfels, const Eigen::Vector3d& up, int width, int height);
/// As a robot's camera sees it, about 63 degrees wide.
PictureView cameraView(const Pose& T_map_cam, int width, int height);

/// What the colours stand for: robots, by contributor bit, which are by name; directions of the map's axes; weights.
/// Nothing for the surfaces' own colours.
std::vector<LegendEntry> legendOf(Colouring colouring, std::span<const std::string> robots);

/// Paints the map on a light ground, with `legend` at its foot. kProblem if nothing of it is in view.
Result<ColourImage> renderPicture(gpu::Device& device, std::span<const Surfel> surfels, const PictureView& view,
                                  Colouring colouring, std::span<const LegendEntry> legend);

}  // namespace comap
