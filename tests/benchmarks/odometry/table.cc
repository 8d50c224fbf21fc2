#include "tests/benchmarks/odometry/table.h"

#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "fleet_tools/command_line/text_table.h"
#include "protocol/types/whole_file.h"
#include "tests/benchmarks/odometry/peers.h"

namespace comap {
namespace {

using Json = nlohmann::json;

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

// Of processor time, which other programs disturb less than the wall clock's.
double ratioToYardstick(const Row& row, const std::vector<Row>& rows) {
  for (const Row& other : rows)
    if (other.sequence == row.sequence && other.method == kYardstick)
      return quantileOf(row.cpu_ms, 0.5) / quantileOf(other.cpu_ms, 0.5);
  return kNone;
}

double overSecond(const Row& row, double value) { return row.relative.spans > 0 ? value : kNone; }

std::string triple(const std::vector<double>& values_ms) {
  return fixed(quantileOf(values_ms, 0.5), 1) + " " + fixed(quantileOf(values_ms, 0.95), 1) + " " +
         fixed(quantileOf(values_ms, 1), 1);
}

Json timesJson(const std::vector<double>& values_ms) {
  return {{"median", quantileOf(values_ms, 0.5)},
          {"p95", quantileOf(values_ms, 0.95)},
          {"worst", quantileOf(values_ms, 1)}};
}

Json numberOrNull(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

}  // namespace

std::string tableOf(const std::vector<Row>& rows) {
  TextTable table({"sequence", "method", "CPU ms med p95 worst", "ratio", "wall ms med p95 worst", "ATE m",
                   "1 s: med mm", "worst mm", "med deg", "worst deg", "drift %", "poor", "lost", "keyframes",
                   "frames"});
  for (const Row& row : rows)
    table.add({row.sequence, row.method, triple(row.cpu_ms), fixed(ratioToYardstick(row, rows), 2), triple(row.wall_ms),
               fixed(row.ate_rmse_m, 4), fixed(overSecond(row, row.relative.translation_median_m * 1e3), 1),
               fixed(overSecond(row, row.relative.translation_worst_m * 1e3), 1),
               fixed(overSecond(row, row.relative.rotation_median_deg), 2),
               fixed(overSecond(row, row.relative.rotation_worst_deg), 2), fixed(row.drift_percent.value_or(kNone), 2),
               std::to_string(row.poor), std::to_string(row.lost), std::to_string(row.keyframes),
               std::to_string(row.frames)});
  return table.text();
}

Result<void> writeJson(const BenchmarkRun& run, const std::string& path) {
  Json json = {{"version", COMAP_VERSION},     {"processor", run.processor}, {"load_before", run.load_before},
               {"load_after", run.load_after}, {"one_core", run.one_core},   {"rows", Json::array()}};
  for (const Row& row : run.rows)
    json["rows"].push_back({{"sequence", row.sequence},
                            {"method", row.method},
                            {"frames", row.frames},
                            {"pairs", row.pairs},
                            {"keyframes", row.keyframes},
                            {"poor", row.poor},
                            {"lost", row.lost},
                            {"cpu_ms", timesJson(row.cpu_ms)},
                            {"wall_ms", timesJson(row.wall_ms)},
                            {"cpu_ratio_to_rgbd_icp", numberOrNull(ratioToYardstick(row, run.rows))},
                            {"path_m", row.path_m},
                            {"ate_rmse_m", row.ate_rmse_m},
                            {"rpe_1s",
                             {{"translation_median_m", row.relative.translation_median_m},
                              {"translation_worst_m", row.relative.translation_worst_m},
                              {"rotation_median_deg", row.relative.rotation_median_deg},
                              {"rotation_worst_deg", row.relative.rotation_worst_deg},
                              {"spans", row.relative.spans}}},
                            {"drift_percent", numberOrNull(row.drift_percent.value_or(kNone))}});
  return writeWholeFile(path, json.dump(1) + "\n");
}

std::string processorName() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    const size_t colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) return line.substr(colon + 2);
  }
  return std::string("unknown");
}

}  // namespace comap
