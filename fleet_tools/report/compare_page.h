// compare.html: the graph mode and the paper mode on the same input, for a person.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "fleet_tools/replay/frames_csv.h"
#include "fleet_tools/report/report_page.h"

namespace comap {

/// The whole page. `comparison` is that of compareJson(); `pictures` are shown in their order; `times` are of all
/// robots in the paper mode.
std::string comparePage(const nlohmann::json& comparison, const std::vector<ReportPicture>& pictures,
                        const RoundTimes& times);

}  // namespace comap
