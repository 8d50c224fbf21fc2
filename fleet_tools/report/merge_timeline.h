// When maps became one, as an SVG drawing.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>

namespace comap {

/// A lane for each robot, from its first keyframe (paper mode: frame) at the core to its last, and a mark across the
/// lanes of the robots of each merge; dashed if it was taken back. From report.json's `timeline` and `merges`; empty if
/// there is no usable timeline. `colours`: of the robots.
std::string mergeTimeline(const nlohmann::json& report, const std::map<std::string, size_t>& colours);

}  // namespace comap
