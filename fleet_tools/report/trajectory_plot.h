// Trajectories from above as an SVG drawing.
#pragma once

#include <span>
#include <string>

#include "fleet_tools/report/report_page.h"

namespace comap {

/// One plot of trajectories in one frame: x to the right, z up, equal scales, a grid in metres, a legend; the truth
/// dashed. Empty if no trajectory has a finite position. Colours are the classes of the page.
std::string trajectoryPlot(std::span<const ReportTrajectory* const> trajectories);

}  // namespace comap
