#include "fleet_tools/replay/run_series.h"

#include <filesystem>
#include <fstream>

#include "fleet_tools/replay/run_folder.h"
#include "protocol/types/whole_file.h"

namespace comap {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

Result<json> readMark(const std::string& path) {
  if (auto regular = checkRegular(path); !regular) return regular.error();
  std::ifstream file(path, std::ios::binary);
  if (!file) return Error{ErrorCode::kUnreachable, path + ": cannot be read"};
  json mark = json::parse(file, nullptr, false);
  if (!mark.is_object())
    return Error{ErrorCode::kBadData, path +
                                          ": is no JSON object, expected what fleet replay wrote; --overwrite begins "
                                          "its runs anew"};
  return mark;
}

// What of two plans is not the same, in words; empty if all is.
std::string differenceOf(const json& there, const json& here) {
  for (const auto& [key, value] : here.items())
    if (there.value(key, json()) != value)
      return key + " " + there.value(key, json()).dump() + " there, " + value.dump() + " here";
  for (const auto& [key, value] : there.items())
    if (!here.contains(key)) return key + " " + value.dump() + " there";
  return "";
}

}  // namespace

Result<RunSeries> RunSeries::begin(const std::string& out, const json& plan, bool overwrite) {
  const std::string mark = seriesMarkOf(out);
  std::error_code none;
  if (!overwrite && isRunFolder(out) && fs::exists(mark, none)) {
    auto lock = StoreLock::take(mark);
    if (!lock) return lock.error();
    const auto there = readMark(mark);
    if (!there) return there.error();
    const std::string difference = differenceOf(*there, plan);
    const size_t finished = finishedRunsIn(out);
    if (difference.empty()) return RunSeries(std::move(*lock), finished);
    if (finished > 0)
      return Error{ErrorCode::kWrongUse, "--out " + out + ": holds runs of another command (" + difference +
                                             "); choose another folder or --overwrite"};
  }
  if (auto made = prepareRunFolder(out, overwrite); !made) return made.error();
  if (auto written = writeWholeFile(mark, plan.dump(2) + "\n"); !written) return written.error();
  auto lock = StoreLock::take(mark);
  if (!lock) return lock.error();
  return RunSeries(std::move(*lock), 0);
}

Result<void> RunSeries::addFolder(const std::string& folder) {
  return isRunFolder(folder) ? Result<void>() : prepareRunFolder(folder, false);
}

Result<std::optional<int>> RunSeries::takeUp(const std::string& folder) {
  const std::string mark = finishedMarkOf(folder);
  std::error_code none;
  if (!fs::exists(mark, none)) {
    if (auto made = prepareRunFolder(folder, true); !made) return made.error();
    return std::optional<int>();
  }
  const auto finished = readMark(mark);
  if (!finished) return finished.error();
  const auto code = finished->find("exit_code");
  if (code == finished->end() || !code->is_number_integer())
    return Error{ErrorCode::kBadData, mark + ": has no exit_code, expected a number"};
  return std::optional(code->get<int>());
}

Result<void> RunSeries::finish(const std::string& folder, int exit_code) {
  return writeWholeFile(finishedMarkOf(folder), json{{"exit_code", exit_code}}.dump() + "\n");
}

}  // namespace comap
