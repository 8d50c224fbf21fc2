// The graph mode and the paper mode on the same input, side by side.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "fleet_tools/replay/frames_csv.h"
#include "fleet_tools/report/report_page.h"

namespace comap {

/// One input, run in both modes; the reports are evaluated if there was a truth.
struct ComparedInput {
  std::string name;  ///< "a", "b", "a+b"
  nlohmann::json graph, paper;
};

/// compare.json: of each input and mode the numbers that both have, and what they say: `at_least_as_accurate` (every
/// error that both have, and maps and false merges), `a_tenth_of_the_bytes`, and in words what is not so. Keys that a
/// report lacks are null.
nlohmann::json compareJson(const std::vector<ComparedInput>& inputs);

/// For a terminal: one line an input and mode, then the words.
std::string compareText(const nlohmann::json& comparison);

/// compare.html; `pictures` are shown in their order.
std::string comparePage(const nlohmann::json& comparison, const std::vector<ReportPicture>& pictures,
                        const RoundTimes& times);

}  // namespace comap
