// How many a discovery server has.
#pragma once

#include <chrono>
#include <string>

#include "protocol/types/result.h"

namespace comap {

struct DiscoveryCounts {
  int robots = 0, cores = 0, observers = 0;  ///< of the site
  int all = 0;                               ///< of all sites
};

/// Asks a few times within `timeout`. kUnreachable without an answer or if `server` (HOST or HOST:PORT) cannot be
/// found.
Result<DiscoveryCounts> askDiscovery(const std::string& server, int domain, const std::string& site,
                                     std::chrono::milliseconds timeout);

}  // namespace comap
