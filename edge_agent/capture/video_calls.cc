#include "edge_agent/capture/video_calls.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <filesystem>

namespace comap {
namespace {

constexpr char kFolder[] = "/dev";
constexpr char kPrefix[] = "video";

class SystemVideoCalls final : public VideoCalls {
 public:
  int open(const std::string& path) override {
    const int descriptor = ::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
    return descriptor < 0 ? -errno : descriptor;
  }
  void close(int descriptor) override { ::close(descriptor); }
  int control(int descriptor, unsigned long request, void* argument) override {
    while (::ioctl(descriptor, request, argument) < 0)
      if (errno != EINTR) return -errno;
    return 0;
  }
  void* map(int descriptor, size_t length, int64_t offset) override {
    void* memory = ::mmap(nullptr, length, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, offset);
    return memory == MAP_FAILED ? nullptr : memory;
  }
  void unmap(void* memory, size_t length) override { ::munmap(memory, length); }
  int wait(int descriptor, std::chrono::milliseconds timeout) override {
    pollfd asked{descriptor, POLLIN | POLLPRI, 0};
    const int ready = ::poll(&asked, 1, static_cast<int>(timeout.count()));
    if (ready < 0) return errno == EINTR ? 0 : -errno;
    return ready == 0 ? 0 : asked.revents;
  }
  std::vector<std::string> nodes() override {
    std::vector<int> numbers;
    std::error_code problem;
    for (std::filesystem::directory_iterator entry(kFolder, problem), end; !problem && entry != end;
         entry.increment(problem)) {
      const std::string name = entry->path().filename().string();
      if (!name.starts_with(kPrefix)) continue;
      int number = 0;
      const char* first = name.data() + sizeof kPrefix - 1;
      const char* last = name.data() + name.size();
      const auto [rest, wrong] = std::from_chars(first, last, number);
      if (wrong == std::errc{} && rest == last) numbers.push_back(number);
    }
    std::sort(numbers.begin(), numbers.end());
    std::vector<std::string> paths;
    for (const int number : numbers) paths.push_back(std::string(kFolder) + "/" + kPrefix + std::to_string(number));
    return paths;
  }
};

}  // namespace

VideoCalls& systemVideoCalls() {
  static SystemVideoCalls calls;
  return calls;
}

}  // namespace comap
