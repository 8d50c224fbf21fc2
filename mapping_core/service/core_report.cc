#include "mapping_core/service/core_report.h"

#include <sys/resource.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "protocol/types/whole_file.h"

namespace comap {
namespace {

double peakRssMb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

}  // namespace

CoreReport reportOf(const MappingService& service, const std::string& device) {
  const ServiceStatistics& statistics = service.statistics();
  CoreReport report;
  report.keyframe_ms_median = statistics.keyframe_ms.quantile_ms(0.5);
  report.keyframe_ms_p95 = statistics.keyframe_ms.quantile_ms(0.95);
  report.keyframes = statistics.keyframe_ms.count();
  report.refused_messages = statistics.refused_messages;
  report.device = device;
  report.peak_rss_mb = peakRssMb();
  report.tile_bytes = service.tileBytes();
  return report;
}

Result<void> writeCoreReport(const CoreReport& report, const std::string& path) {
  const nlohmann::json json = {{"keyframe_ms_median", report.keyframe_ms_median},
                               {"keyframe_ms_p95", report.keyframe_ms_p95},
                               {"keyframes", report.keyframes},
                               {"refused_messages", report.refused_messages},
                               {"device", report.device},
                               {"peak_rss_mb", report.peak_rss_mb},
                               {"tile_bytes", report.tile_bytes}};
  return writeWholeFile(path, json.dump(2) + "\n", FileKind::kJson);
}

Result<CoreReport> readCoreReport(const std::string& path) {
  if (auto regular = checkRegular(path); !regular) return regular.error();
  std::ifstream file(path);
  if (!file) return Error{ErrorCode::kUnreachable, path + ": no such file, or it cannot be read"};
  try {
    const auto json = nlohmann::json::parse(file);
    CoreReport report;
    report.keyframe_ms_median = json.at("keyframe_ms_median").get<double>();
    report.keyframe_ms_p95 = json.at("keyframe_ms_p95").get<double>();
    report.keyframes = json.at("keyframes").get<uint64_t>();
    report.refused_messages = json.at("refused_messages").get<uint64_t>();
    report.device = json.at("device").get<std::string>();
    report.peak_rss_mb = json.at("peak_rss_mb").get<double>();
    report.tile_bytes = json.at("tile_bytes").get<std::map<std::string, uint64_t>>();
    return report;
  } catch (const nlohmann::json::exception& problem) {
    return Error{ErrorCode::kBadData, path + ": not a core's report: " + problem.what()};
  }
}

}  // namespace comap
