// What the core says about its run when it ends: a JSON file for tools.
#pragma once

#include <map>
#include <string>

#include "mapping_core/service/mapping_service.h"

namespace comap {

struct CoreReport {
  double keyframe_ms_median = 0, keyframe_ms_p95 = 0;
  uint64_t keyframes = 0, refused_messages = 0;
  std::string device;
  double peak_rss_mb = 0;
  std::map<std::string, uint64_t> tile_bytes;  ///< sent, by robot
};

CoreReport reportOf(const MappingService& service, const std::string& device);
Result<void> writeCoreReport(const CoreReport& report, const std::string& path);
Result<CoreReport> readCoreReport(const std::string& path);

}  // namespace comap
