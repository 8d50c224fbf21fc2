// The pictures of a run's map, beside its report.
#pragma once

#include <span>

#include "fleet_tools/report/report_page.h"
#include "mapping_core/surfels/surfel_map.h"

namespace comap {

/// Draws the map as a whole, from above and by contributors into `folder`; `robots` by contributor bit.
Result<void> paintMap(const std::string& folder, const std::string& device_choice,
                      const std::vector<std::string>& robots, const std::vector<Surfel>& surfels,
                      const std::vector<Pose>& T_map_cams);

/// Those pictures that `folder` has.
Result<std::vector<ReportPicture>> readMapPictures(const std::string& folder);

}  // namespace comap
