#include "fleet_tools/command_line/output_file.h"

#include <filesystem>
#include <fstream>
#include <string_view>

namespace comap {
namespace {

namespace fs = std::filesystem;

Error refused(const std::string& path, const std::string& why) {
  return {ErrorCode::kWrongUse, "--out " + path + ": " + why};
}

Result<void> checkName(const std::string& path) {
  return path.empty() ? Result<void>(Error{ErrorCode::kWrongUse, "--out: the name is empty"}) : Result<void>();
}

bool isDatabase(const std::string& path) {
  constexpr std::string_view kMagic = "SQLite format 3";
  std::ifstream file(path, std::ios::binary);
  std::string start(kMagic.size(), '\0');
  file.read(start.data(), static_cast<std::streamsize>(start.size()));
  return file && start == kMagic;
}

}  // namespace

Result<void> checkOutputFile(const std::string& path) {
  if (auto named = checkName(path); !named) return named;
  std::error_code code;
  const fs::file_status status = fs::status(path, code);
  if (!fs::exists(status)) {
    const fs::path folder = fs::absolute(path, code).parent_path();
    if (fs::is_directory(folder, code)) return {};
    return Error{ErrorCode::kUnreachable, "--out " + path + ": folder " + folder.string() + " does not exist"};
  }
  // Before it is opened: of a pipe the first byte would be waited for.
  if (fs::is_directory(status)) return refused(path, "is a folder, expected a file");
  if (!fs::is_regular_file(status)) return refused(path, "is no regular file");
  if (isDatabase(path)) return refused(path, "is a map store or another database; choose another name");
  return {};
}

Result<void> checkOutputFolder(const std::string& path) {
  if (auto named = checkName(path); !named) return named;
  std::error_code code;
  const fs::file_status status = fs::status(path, code);
  if (fs::exists(status) && !fs::is_directory(status)) return refused(path, "is a file, expected a folder");
  return {};
}

}  // namespace comap
