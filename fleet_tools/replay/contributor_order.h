// Robots in the order that a run was given them in, so that each has one colour in all runs of them.
#pragma once

#include "fleet_tools/replay/replay.h"
#include "mapping_core/surfels/surfel_map.h"

namespace comap {

/// Its place in that order; as many as there are for a name that is not among them.
size_t orderOf(const std::vector<ReplayRobot>& robots, const std::string& name);

/// Contributor bits by that order, instead of by `arrived`, that of arrival at the core. Returns whose bit is which.
std::vector<std::string> orderContributors(const std::vector<ReplayRobot>& robots,
                                           const std::vector<std::string>& arrived, std::vector<Surfel>& surfels);

}  // namespace comap
