#include "fleet_tools/replay/run_folder.h"

#include <filesystem>
#include <fstream>
#include <vector>

#include "mapping_core/store/store_lock.h"

namespace comap {
namespace {

constexpr const char* kRunMark = "/.comap-run";

}  // namespace

Result<void> prepareRunFolder(const std::string& out, bool overwrite) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (fs::exists(out, error) && !fs::is_empty(out, error)) {
    if (!fs::exists(out + kRunMark, error))
      return Error{ErrorCode::kWrongUse, "--out " + out + ": folder is not empty and holds no earlier run"};
    bool holds_run = false;
    std::vector<std::string> runs = {out};
    for (const auto& entry : fs::directory_iterator(out, error))
      if (fs::exists(entry.path().string() + kRunMark, error)) runs.push_back(entry.path().string());
    for (const std::string& earlier : runs) {
      holds_run = holds_run || fs::exists(earlier + "/report.json", error);
      if (!fs::exists(storePathOf(earlier), error)) continue;
      holds_run = true;
      if (auto free = StoreLock::take(storePathOf(earlier)); !free) return free.error();
    }
    if (holds_run && !overwrite)
      return Error{ErrorCode::kWrongUse,
                   "--out " + out + ": holds a run already; choose another folder or --overwrite"};
    fs::remove_all(out, error);
  }
  fs::create_directories(out, error);
  std::ofstream mark(out + kRunMark);
  mark << "A run of fleet replay; --overwrite may empty this folder.\n";
  mark.close();
  if (error || !mark) return Error{ErrorCode::kUnreachable, "--out " + out + ": cannot be made or written"};
  return {};
}

std::string storePathOf(const std::string& run) { return (std::filesystem::path(run) / "map.comap").string(); }

}  // namespace comap
