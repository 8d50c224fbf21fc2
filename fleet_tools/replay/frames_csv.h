// frames.csv: what each frame of each camera cost and did in a run of the paper mode.
#pragma once

#include <string>
#include <vector>

#include "mapping_core/paper/paper_core.h"
#include "protocol/types/result.h"

namespace comap {

/// Milliseconds of all stages together.
double totalMs(const PaperFrameRecord& record);

/// The file's text: a head and a line a record. `cameras`: their names, by number; they hold no comma.
std::string framesCsv(const std::vector<PaperFrameRecord>& records, const std::vector<std::string>& cameras);

/// Milliseconds that each tick took in the paper mode, by camera.
struct RoundTimes {
  std::vector<std::string> cameras;
  std::vector<std::vector<double>> ms;  ///< of each tick, of each camera
  std::vector<size_t> merges;           ///< ticks, the first being 1
};

/// Reads such a file. kUnreachable, kBadData.
Result<RoundTimes> readRoundTimes(const std::string& path);

}  // namespace comap
