#include "mapping_core/service/store_file.h"

#include <sys/stat.h>

namespace comap {

StoreFile::StoreFile(std::string path) : path_(std::move(path)), store_(identityOf(path_)) {}

std::optional<StoreFile::Identity> StoreFile::identityOf(const std::string& path) {
  struct stat status {};
  if (stat(path.c_str(), &status) != 0) return std::nullopt;
  return Identity{status.st_dev, status.st_ino};
}

std::string StoreFile::trouble() {
  if (!log_) log_ = identityOf(path_ + "-wal");
  for (const auto& [path, opened] : {std::pair(path_, store_), std::pair(path_ + "-wal", log_)}) {
    const auto now = opened ? identityOf(path) : std::nullopt;
    if (now == opened) continue;
    return path + (now ? ": another file has taken its place" : ": was deleted or moved away") +
           " while this core writes it; put it back, or start the core anew: what it acknowledged is in the file that "
           "was there";
  }
  return {};
}

}  // namespace comap
