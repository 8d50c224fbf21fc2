#include "fleet_tools/replay/frames_csv.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>

#include <array>
#include <fstream>
#include <sstream>

#include "protocol/types/whole_file.h"

namespace comap {
namespace {

// In the order of the file.
enum Column : size_t {
  kTick,
  kCamera,
  kTrack_ms,
  kLoop_ms,
  kFuse_ms,
  kPredict_ms,
  kFerns_ms,
  kInterMap_ms,
  kTotal_ms,
  kMaps,
  kSurfels,
  kLocalLoop,
  kGlobalLoop,
  kMerged,
  kLost,
  kLoopPoints,
  kLoopNodes,
  kColumns
};

constexpr const char* kHead =
    "tick,camera,track_ms,loop_ms,fuse_ms,predict_ms,ferns_ms,inter_map_ms,total_ms,maps,surfels,local_loop,"
    "global_loop,merged,lost,loop_points,loop_nodes";

using Cells = std::array<std::string, kColumns>;

Cells cellsOf(const PaperFrameRecord& record, const std::vector<std::string>& cameras) {
  const auto ms = [](double value) { return fmt::format("{:.2f}", value); };
  const auto yesNo = [](bool value) { return fmt::format("{:d}", value); };
  Cells cells;
  cells[kTick] = std::to_string(record.tick);
  cells[kCamera] = cameras[record.camera];
  cells[kTrack_ms] = ms(record.ms.track);
  cells[kLoop_ms] = ms(record.ms.loop);
  cells[kFuse_ms] = ms(record.ms.fuse);
  cells[kPredict_ms] = ms(record.ms.predict);
  cells[kFerns_ms] = ms(record.ms.ferns);
  cells[kInterMap_ms] = ms(record.inter_map_ms);
  cells[kTotal_ms] = ms(totalMs(record));
  cells[kMaps] = std::to_string(record.maps);
  cells[kSurfels] = std::to_string(record.surfels);
  cells[kLocalLoop] = yesNo(record.local_loop);
  cells[kGlobalLoop] = yesNo(record.global_loop);
  cells[kMerged] = yesNo(record.merged);
  cells[kLost] = yesNo(record.lost);
  cells[kLoopPoints] = std::to_string(record.loop_points);
  cells[kLoopNodes] = std::to_string(record.loop_nodes);
  return cells;
}

}  // namespace

double totalMs(const PaperFrameRecord& record) {
  const StageTimes& ms = record.ms;
  return ms.track + ms.loop + ms.fuse + ms.predict + ms.ferns + record.inter_map_ms;
}

std::string framesCsv(const std::vector<PaperFrameRecord>& records, const std::vector<std::string>& cameras) {
  std::string text = std::string(kHead) + "\n";
  for (const PaperFrameRecord& record : records) text += fmt::format("{}\n", fmt::join(cellsOf(record, cameras), ","));
  return text;
}

Result<RoundTimes> readRoundTimes(const std::string& path) {
  if (auto regular = checkRegular(path); !regular) return regular.error();
  std::ifstream file(path);
  if (!file) return Error{ErrorCode::kUnreachable, path + ": cannot be read"};
  RoundTimes times;
  std::string line;
  std::getline(file, line);  // the head
  for (size_t number = 2; std::getline(file, line); ++number) {
    std::vector<std::string> cells;
    std::istringstream words(line);
    for (std::string word; std::getline(words, word, ',');) cells.push_back(word);
    const auto bad = [&] {
      return Error{ErrorCode::kBadData,
                   fmt::format("{}:{}: expected {} columns with numbers", path, number, size_t{kColumns})};
    };
    if (cells.size() != kColumns) return bad();
    try {
      const size_t tick = std::stoul(cells[kTick]);
      if (tick == 0 || tick > kLastTick) return bad();
      size_t camera = 0;
      while (camera < times.cameras.size() && times.cameras[camera] != cells[kCamera]) ++camera;
      if (camera == times.cameras.size()) times.cameras.push_back(cells[kCamera]);
      if (times.ms.size() < tick) times.ms.resize(tick);
      if (times.ms[tick - 1].size() <= camera) times.ms[tick - 1].resize(camera + 1, 0.0);
      times.ms[tick - 1][camera] = std::stod(cells[kTotal_ms]);
      if (cells[kMerged] == "1") times.merges.push_back(tick);
    } catch (const std::exception&) {
      return bad();
    }
  }
  return times;
}

}  // namespace comap
