// What `fleet watch` says: a screen, a line, a JSON document.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "fleet_tools/watch/site_watch.h"

namespace comap {

std::vector<std::string> watchScreen(const SiteWatch& watch, const std::string& site, bool core_there,
                                     WatchClock::time_point now);
/// One line for logs.
std::string watchLine(const SiteWatch& watch, bool core_there, WatchClock::time_point now);
nlohmann::json watchJson(const SiteWatch& watch, const std::string& site, bool core_there, WatchClock::time_point now);

}  // namespace comap
