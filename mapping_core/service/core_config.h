// Everything the mapping core can be told, with defaults that work.
#pragma once

#include <string>

#include "mapping_core/service/mapping_service.h"
#include "protocol/link/dds_link.h"
#include "protocol/ros2/ros2_node.h"
#include "protocol/telemetry/telemetry.h"

namespace comap {

struct CoreConfig {
  std::string store = "map.comap";
  std::string device = "auto";
  DdsLinkOptions link;
  int serve_discovery = 0;  ///< UDP port on which the core is the site's discovery server itself; 0: it is none
  ServiceOptions service;
  TelemetryOptions telemetry;
  ros2::Ros2Options ros2;
};

/// Reads a YAML file; unknown keys, wrong types and values out of range are errors that name file, line and key.
Result<CoreConfig> readCoreConfig(const std::string& path);
/// The configuration as commented YAML that readCoreConfig takes.
std::string printCoreConfig(const CoreConfig& config);

}  // namespace comap
