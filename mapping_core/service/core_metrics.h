// The mapping service in the terms of its operators: numbers for Prometheus, one line for people.
#pragma once

#include <string>

#include "mapping_core/service/mapping_service.h"
#include "protocol/telemetry/telemetry.h"

namespace comap {

constexpr char kCoreMetrics[] = "comap_core";  ///< what the names of all its metrics begin with

/// `ready`: it takes messages and does not only finish its store. Whether that takes keyframes is seen here.
Telemetry::Report reportOf(const MappingService& service, const std::string& device, bool ready);

}  // namespace comap
