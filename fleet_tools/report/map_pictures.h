// The pictures of a run's map, beside its report.
#pragma once

#include <span>

#include "fleet_tools/report/report_page.h"
#include "mapping_core/surfels/surfel_map.h"

namespace comap {

/// Draws the map as a whole, from above and by contributors into `folder`; `robots` of them get a legend.
Result<void> paintMap(const std::string& folder, const std::string& device_choice, size_t robots,
                      const std::vector<Surfel>& surfels, const std::vector<Pose>& T_map_cams);

/// Those pictures that `folder` has.
Result<std::vector<ReportPicture>> readMapPictures(const std::string& folder);

}  // namespace comap
