#include "fleet_tools/command_line/output_file.h"

#include <fstream>
#include <string_view>

namespace comap {

Result<void> refuseDatabase(const std::string& path) {
  constexpr std::string_view kMagic = "SQLite format 3";
  std::ifstream file(path, std::ios::binary);
  std::string start(kMagic.size(), '\0');
  file.read(start.data(), static_cast<std::streamsize>(start.size()));
  if (!file || start != kMagic) return {};
  return Error{ErrorCode::kWrongUse, "--out " + path + ": is a map store or another database; choose another name"};
}

}  // namespace comap
