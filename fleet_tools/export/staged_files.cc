#include "fleet_tools/export/staged_files.h"

#include <unistd.h>

namespace comap {
namespace {

namespace fs = std::filesystem;

Error cannot(const char* what, const fs::path& path, const std::error_code& code) {
  return {ErrorCode::kUnreachable, path.string() + ": cannot " + what + ": " + code.message()};
}

}  // namespace

StagedFiles::~StagedFiles() {
  std::error_code code;
  for (const auto& [staged, final] : files_) fs::remove(staged, code);
  for (auto folder = folders_.rbegin(); folder != folders_.rend(); ++folder) fs::remove(*folder, code);
}

Result<void> StagedFiles::makeFolder(const fs::path& folder) {
  std::error_code code;
  if (fs::is_directory(folder, code)) return {};
  if (!fs::create_directory(folder, code)) return cannot("make folder", folder, code);
  folders_.push_back(folder);
  return {};
}

std::string StagedFiles::stage(const fs::path& final) {
  files_.emplace_back(final.string() + ".part-" + std::to_string(getpid()), final);
  return files_.back().first.string();
}

Error StagedFiles::named(Error error) const {
  for (const auto& [staged, final] : files_)
    if (const size_t at = error.text.find(staged.string()); at != std::string::npos)
      error.text.replace(at, staged.string().size(), final.string());
  return error;
}

Result<void> StagedFiles::commit() {
  for (const auto& [staged, final] : files_) {
    std::error_code code;
    if (fs::exists(final, code) && !fs::is_regular_file(final, code))
      return Error{ErrorCode::kWrongUse, final.string() + ": is no regular file"};
    fs::rename(staged, final, code);
    if (code) return cannot("write", final, code);
  }
  files_.clear();
  folders_.clear();
  return {};
}

}  // namespace comap
