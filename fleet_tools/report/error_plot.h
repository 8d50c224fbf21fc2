// How wrong each robot's position was, over time, as an SVG drawing.
#pragma once

#include <span>
#include <string>

#include "fleet_tools/report/report_page.h"

namespace comap {

/// Millimetres over the seconds since each robot's own first pose. A line is broken where a robot has no pose for more
/// than a second. Empty if no trajectory has an error.
std::string errorPlot(std::span<const ReportTrajectory> trajectories);

}  // namespace comap
