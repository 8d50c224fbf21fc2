// The map of a run as a file of points and as pictures, whatever mode made it.
#pragma once

#include <span>

#include "fleet_tools/report/report_page.h"
#include "mapping_core/surfels/surfel_map.h"

namespace comap {

/// Writes points with normals, colours, radii and confidences.
Result<void> writeMapPly(const std::string& path, std::span<const Surfel> surfels);

/// Draws the map as a whole, from above and by contributors into `folder`; `robots` of them get a legend.
Result<std::vector<ReportPicture>> paintMap(const std::string& folder, const std::string& device_choice, size_t robots,
                                            const std::vector<Surfel>& surfels, const std::vector<Pose>& T_map_cams);

}  // namespace comap
