// What a run came to, for people.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace comap {

/// Prints report.json of a run of the graph mode.
void printRunSummary(const nlohmann::json& report, const std::string& out);
/// Of a run of the paper mode.
void printPaperSummary(const nlohmann::json& report, const std::string& out);

/// Tells, and returns the exit code, if the run's files are there but do not show what was asked for; else 0.
int failIfIncomplete(const nlohmann::json& report);

}  // namespace comap
