// Rows as a table for people and as JSON for tools.
#pragma once

#include <string>
#include <vector>

#include "protocol/types/result.h"
#include "tests/benchmarks/odometry/scores.h"

namespace comap {

/// Aligned columns with a head; speed in relation to the yardstick's on the same sequence where that ran.
std::string tableOf(const std::vector<Row>& rows);

/// The circumstances and the rows.
struct BenchmarkRun {
  std::string processor;   ///< model name
  double load_before = 0;  ///< programs that wanted to run in the minute before
  double load_after = 0;
  bool one_core = false;  ///< kept on one core
  std::vector<Row> rows;
};

Result<void> writeJson(const BenchmarkRun& run, const std::string& path);

/// The processor's model name, "unknown" if the system does not tell.
std::string processorName();

}  // namespace comap
