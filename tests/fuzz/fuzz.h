// What the fuzz programs share: bytes as a file, and promises that end the program when they are broken.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>

namespace comap::fuzz {

using Bytes = std::span<const uint8_t>;

/// Ends the program, which libFuzzer takes for a finding, if `holds` is false.
inline void require(bool holds, const char* promise) {
  if (holds) return;
  std::fprintf(stderr, "broken promise: %s\n", promise);
  std::abort();
}

/// A file in memory with these bytes, as long as it lives.
class MemoryFile {
 public:
  explicit MemoryFile(Bytes bytes) : file_(memfd_create("comap-fuzz", 0)) {
    require(file_ >= 0 && write(file_, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size()),
            "a file in memory can be written");
  }
  ~MemoryFile() { close(file_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  std::string path() const { return "/proc/self/fd/" + std::to_string(file_); }

 private:
  int file_;
};

/// A folder in memory, removed when the program ends well.
class MemoryFolder {
 public:
  MemoryFolder() : path_("/dev/shm/comap-fuzz-" + std::to_string(getpid())) {
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  ~MemoryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  MemoryFolder(const MemoryFolder&) = delete;
  MemoryFolder& operator=(const MemoryFolder&) = delete;
  std::string operator/(const std::string& name) const { return path_ + "/" + name; }
  std::string write(const std::string& name, Bytes bytes) const {
    const std::string path = path_ + "/" + name;
    std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(bytes.data()), std::ssize(bytes));
    return path;
  }

 private:
  std::string path_;
};

inline std::string textOf(Bytes bytes) { return {reinterpret_cast<const char*>(bytes.data()), bytes.size()}; }

}  // namespace comap::fuzz

#define COMAP_FUZZ_TARGET(bytes)                                            \
  static void runOne(comap::fuzz::Bytes bytes);                             \
  extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) { \
    runOne({data, size});                                                   \
    return 0;                                                               \
  }                                                                         \
  static void runOne(comap::fuzz::Bytes bytes)
