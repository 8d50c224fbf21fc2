#include "fleet_tools/replay/run_folder.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <vector>

#include "mapping_core/store/store_lock.h"

namespace comap {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRunMark = ".comap-run";
// Of several runs in one folder: what they all are, and that one is finished.
constexpr const char* kSeriesMark = ".comap-series";
constexpr const char* kFinishedMark = ".comap-finished";
constexpr const char* kLogs = "logs";
// What replay, evaluate and report write into a run, beside the store, a trajectory for each robot and the logs.
constexpr std::array<std::string_view, 17> kRunFiles = {
    kRunMark,       kSeriesMark,    kFinishedMark, "events.log",    "frames.csv",           "map.ply",
    "map.png",      "map-top.png",  "report.json", "report.html",   "map-contribution.png", "errors.csv",
    "compare.json", "compare.html", "map.comap",   "map.comap-wal", "map.comap-shm"};

// Under which a file is written until it is whole: NAME.part, or NAME.part- and a process.
std::string_view withoutDraft(std::string_view name) {
  constexpr std::string_view kPart = ".part", kDigits = "0123456789";
  const size_t at = name.rfind(kPart);
  if (at == std::string_view::npos) return name;
  const std::string_view rest = name.substr(at + kPart.size());
  const bool of_process = rest.size() > 1 && rest[0] == '-' && rest.find_first_not_of(kDigits, 1) == rest.npos;
  return rest.empty() || of_process ? name.substr(0, at) : name;
}

bool isFileOfARun(std::string_view name) {
  name = withoutDraft(name);
  return std::find(kRunFiles.begin(), kRunFiles.end(), name) != kRunFiles.end() || name.ends_with(".trajectory.txt");
}

bool isLog(const std::string& name) {
  const fs::path log(withoutDraft(name));
  return log.extension() == ".log" || log.extension() == ".json" || log == "config.yaml";
}

bool isFolder(const fs::directory_entry& entry) {
  std::error_code problem;
  return !entry.is_symlink(problem) && entry.is_directory(problem);
}

bool isFile(const fs::directory_entry& entry) {
  std::error_code problem;
  return !entry.is_symlink(problem) && entry.is_regular_file(problem);
}

// The first entry that no run wrote; empty if there is none.
Result<fs::path> foreignIn(const fs::path& folder, bool logs = false) {
  std::error_code problem;
  for (fs::directory_iterator at(folder, problem), end; !problem && at != end; at.increment(problem)) {
    const fs::path name = at->path().filename();
    if (isFile(*at) && (logs ? isLog(name.string()) : isFileOfARun(name.string()))) continue;
    const bool own = !logs && isFolder(*at) && (name == kLogs || fs::exists(at->path() / kRunMark, problem));
    if (!own) return at->path();
    auto inside = foreignIn(at->path(), name == kLogs);
    if (!inside || !inside->empty()) return inside;
  }
  if (problem) return Error{ErrorCode::kUnreachable, folder.string() + ": cannot be listed: " + problem.message()};
  return fs::path();
}

// The mark goes last, so that what was interrupted can be done again; what says that a run is finished goes first.
std::error_code emptyRun(const fs::path& folder) {
  std::error_code problem;
  for (const char* mark : {kSeriesMark, kFinishedMark})
    if (!problem) fs::remove(folder / mark, problem);
  std::vector<fs::path> entries;
  for (fs::directory_iterator at(folder, problem), end; !problem && at != end; at.increment(problem))
    if (at->path().filename() != kRunMark) entries.push_back(at->path());
  for (const fs::path& entry : entries) {
    if (!problem && fs::is_directory(fs::symlink_status(entry, problem))) problem = emptyRun(entry);
    if (!problem) fs::remove(entry, problem);
  }
  if (!problem) fs::remove(folder / kRunMark, problem);
  return problem;
}

Result<void> clearEarlierRun(const std::string& out, bool overwrite) {
  std::error_code problem;
  if (!isRunFolder(out))
    return Error{ErrorCode::kWrongUse, "--out " + out + ": folder is not empty and holds no earlier run"};
  bool holds_run = finishedRunsIn(out) > 0;
  std::vector<std::string> runs = {out};
  for (fs::directory_iterator at(out, problem), end; !problem && at != end; at.increment(problem))
    if (isFolder(*at) && fs::exists(at->path() / kRunMark, problem)) runs.push_back(at->path().string());
  const std::string series = seriesMarkOf(out);
  if (fs::exists(series, problem))
    if (auto free = StoreLock::take(series); !free) return free.error();
  for (const std::string& earlier : runs) {
    holds_run = holds_run || fs::exists(earlier + "/report.json", problem);
    if (!fs::exists(storePathOf(earlier), problem)) continue;
    holds_run = true;
    if (auto free = StoreLock::take(storePathOf(earlier)); !free) return free.error();
  }
  if (holds_run && !overwrite)
    return Error{ErrorCode::kWrongUse, "--out " + out + ": holds a run already; choose another folder or --overwrite"};
  const auto foreign = foreignIn(out);
  if (!foreign) return foreign.error();
  if (!foreign->empty())
    return Error{ErrorCode::kWrongUse, "--out " + out + ": holds " + foreign->string() +
                                           ", which no run wrote; move it away, or choose another folder"};
  if (const auto failed = emptyRun(out))
    return Error{ErrorCode::kUnreachable, "--out " + out + ": cannot be emptied: " + failed.message()};
  return {};
}

}  // namespace

Result<void> prepareRunFolder(const std::string& out, bool overwrite) {
  if (out.empty()) return Error{ErrorCode::kWrongUse, "--out: is empty, expected a folder"};
  std::error_code problem;
  const auto status = fs::status(out, problem);
  if (fs::exists(status) && !fs::is_directory(status))
    return Error{ErrorCode::kWrongUse, "--out " + out + ": is there and is no folder"};
  if (fs::exists(status)) {
    const bool empty = fs::is_empty(out, problem);
    if (problem) return Error{ErrorCode::kUnreachable, "--out " + out + ": cannot be listed: " + problem.message()};
    if (!empty)
      if (auto cleared = clearEarlierRun(out, overwrite); !cleared) return cleared;
  }
  problem.clear();
  fs::create_directories(out, problem);
  if (problem) return Error{ErrorCode::kUnreachable, "--out " + out + ": cannot be made: " + problem.message()};
  std::ofstream mark(fs::path(out) / kRunMark);
  mark << "A run of fleet replay; --overwrite removes what the run wrote.\n";
  mark.close();
  if (!mark) return Error{ErrorCode::kUnreachable, "--out " + out + ": cannot be written"};
  return {};
}

std::string storePathOf(const std::string& run) { return (fs::path(run) / "map.comap").string(); }
std::string seriesMarkOf(const std::string& out) { return (fs::path(out) / kSeriesMark).string(); }
std::string finishedMarkOf(const std::string& run) { return (fs::path(run) / kFinishedMark).string(); }

bool isRunFolder(const std::string& folder) {
  std::error_code problem;
  return fs::exists(fs::path(folder) / kRunMark, problem);
}

size_t finishedRunsIn(const std::string& out) {
  std::error_code problem;
  size_t finished = 0;
  for (fs::recursive_directory_iterator at(out, problem), end; !problem && at != end; at.increment(problem))
    finished += at->path().filename() == kFinishedMark;
  return finished;
}

}  // namespace comap
