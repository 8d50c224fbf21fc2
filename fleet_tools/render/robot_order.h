// Robots in the order of their names, so that each has one colour in all pictures, pages and views, whoever was first.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "mapping_core/surfels/surfel_map.h"

namespace comap {

/// Of each robot its place among all by name: the number of its colour.
std::vector<size_t> placesByName(std::span<const std::string> robots);

/// The names as those places say; `others`, who have no part in the map, come after all that have.
std::vector<std::string> orderByName(std::span<const std::string> robots, std::span<const std::string> others = {});

/// Contributor bits by name, instead of by `robots`, who has which. Returns whose bit is which.
std::vector<std::string> orderContributors(std::span<const std::string> robots, std::vector<Surfel>& surfels);

}  // namespace comap
