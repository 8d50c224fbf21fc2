#include "protocol/types/whole_file.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>

namespace comap {

namespace {

struct Kind {
  std::string_view name, start;  // a file of it begins with one of these
  bool any_of_start;             // with one of the bytes of `start`, not with all
};

Kind kindOf(FileKind kind) {
  switch (kind) {
    case FileKind::kJson:
      return {"JSON", "{[", true};
    case FileKind::kPng:
      return {"a PNG picture", "\x89PNG", false};
    case FileKind::kAny:
      break;
  }
  return {};
}

std::string_view nameOf(mode_t mode) {
  return S_ISDIR(mode) ? "a folder" : S_ISFIFO(mode) ? "a named pipe" : S_ISSOCK(mode) ? "a socket" : "a device";
}

}  // namespace

Result<void> checkRegular(const std::string& path) {
  struct stat there {};
  if (stat(path.c_str(), &there) != 0 || S_ISREG(there.st_mode)) return {};
  return Error{ErrorCode::kUnreachable,
               path + ": is " + std::string(nameOf(there.st_mode)) + ", expected a regular file"};
}

Result<void> checkReplaceable(const std::string& path, FileKind kind) {
  struct stat there {};
  if (stat(path.c_str(), &there) != 0 || !S_ISREG(there.st_mode))
    return {};  // of a pipe the first byte would be waited for
  constexpr std::string_view kMagic = "SQLite format 3";
  std::ifstream file(path, std::ios::binary);
  std::string start(kMagic.size(), '\0');
  file.read(start.data(), static_cast<std::streamsize>(start.size()));
  start.resize(static_cast<size_t>(file.gcount()));
  if (start == kMagic)
    return Error{ErrorCode::kWrongUse, path + ": is a map store or another database; choose another name"};
  const Kind wanted = kindOf(kind);
  if (start.empty() || kind == FileKind::kAny) return {};
  const bool same = wanted.any_of_start ? wanted.start.find(start.front()) != std::string_view::npos
                                        : start.starts_with(wanted.start);
  if (same) return {};
  return Error{ErrorCode::kWrongUse, path + ": is there and is not " + std::string(wanted.name) +
                                         ", which would take its place; choose another name"};
}

Result<void> checkWritable(const std::string& path, FileKind kind) {
  if (path.empty()) return {};
  const size_t slash = path.rfind('/');
  const std::string folder = slash == std::string::npos ? "." : path.substr(0, slash + 1);
  if (access(folder.c_str(), W_OK) != 0)
    return Error{ErrorCode::kUnreachable, path + ": cannot be written: " + std::strerror(errno)};
  return checkReplaceable(path, kind);
}

Result<void> writeWholeFile(const std::string& path, std::string_view content, FileKind kind) {
  struct stat there {};
  if (stat(path.c_str(), &there) == 0 && !S_ISREG(there.st_mode))
    return Error{ErrorCode::kUnreachable, path + ": is no regular file"};
  if (auto free = checkReplaceable(path, kind); !free) return free;
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
