#include "protocol/types/whole_file.h"

#include <cerrno>
#include <cstdio>
#include <cstring>

namespace comap {

Result<void> writeWholeFile(const std::string& path, std::string_view content) {
  const std::string temporary = path + ".part";
  std::FILE* file = std::fopen(temporary.c_str(), "wb");
  if (file == nullptr) return Error{ErrorCode::kUnreachable, path + ": cannot be written: " + std::strerror(errno)};
  const bool written = std::fwrite(content.data(), 1, content.size(), file) == content.size();
  const bool closed = std::fclose(file) == 0;
  if (!written || !closed || std::rename(temporary.c_str(), path.c_str()) != 0) {
    const Error error{ErrorCode::kUnreachable, path + ": cannot be written: " + std::strerror(errno)};
    std::remove(temporary.c_str());
    return error;
  }
  return {};
}

}  // namespace comap
