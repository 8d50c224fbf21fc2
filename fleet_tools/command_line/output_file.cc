#include "fleet_tools/command_line/output_file.h"

#include <filesystem>

#include "protocol/types/whole_file.h"

namespace comap {
namespace {

namespace fs = std::filesystem;

Error refused(const std::string& path, const std::string& why) {
  return {ErrorCode::kWrongUse, "--out " + path + ": " + why};
}

Result<void> checkName(const std::string& path) {
  return path.empty() ? Result<void>(Error{ErrorCode::kWrongUse, "--out: the name is empty"}) : Result<void>();
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
  if (const auto free = checkReplaceable(path, FileKind::kAny); !free)
    return Error{free.error().code, "--out " + free.error().text};
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
