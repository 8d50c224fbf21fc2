// Parts of a report's page that are made of its numbers alone. What a report does not have is left out: empty.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace comap {

/// The numbers that say most, large.
std::string cards(const nlohmann::json& report);
/// Where the depth pictures contradict the truth, the worst first: there an error says as much about the truth.
std::string contradictions(const nlohmann::json& report);
/// How place matches were judged, as bars.
std::string verdicts(const nlohmann::json& report);
std::string timings(const nlohmann::json& report);
/// Name and value of what is there; objects one level deep.
std::string parameters(const nlohmann::json& report);
/// All of it, as it is written.
std::string rawReport(const nlohmann::json& report);

}  // namespace comap
