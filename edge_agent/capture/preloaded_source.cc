#include "edge_agent/capture/preloaded_source.h"

#include <fstream>
#include <limits>
#include <string>
#include <vector>

namespace comap {
namespace {

using Taken = Result<std::optional<Frame>>;

class PreloadedSource final : public FrameSource {
 public:
  PreloadedSource(std::string description, size_t size, std::vector<Taken> taken)
      : description_(std::move(description)), size_(size), taken_(std::move(taken)) {}

  Taken next() override {
    if (position_ == taken_.size()) return std::optional<Frame>();
    return std::move(taken_[position_++]);
  }
  size_t size() const override { return size_; }
  std::string description() const override { return description_; }

 private:
  std::string description_;
  size_t size_;
  std::vector<Taken> taken_;
  size_t position_ = 0;
};

uint64_t bytesOf(const Frame& frame) {
  return frame.colour.size() * sizeof(Rgb) + frame.depth.size() * sizeof(uint16_t);
}

// What Linux can give without swapping; all there is if it does not say.
uint64_t freeMemory() {
  std::ifstream file("/proc/meminfo");
  for (std::string key; file >> key;) {
    if (key != "MemAvailable:") continue;
    if (uint64_t kib = 0; file >> kib) return kib * 1024;
  }
  return std::numeric_limits<uint64_t>::max();
}

std::string megabytes(uint64_t bytes) { return std::to_string(bytes / 1'000'000) + " MB"; }

}  // namespace

Result<std::unique_ptr<FrameSource>> preload(std::unique_ptr<FrameSource> source, const std::function<bool()>& stopped,
                                             uint64_t most_bytes) {
  const std::string description = source->description();
  const size_t size = source->size();
  if (source->live() || size == 0)
    return Error{ErrorCode::kWrongUse,
                 description + ": cannot be read before it plays: a recording of known length is expected"};
  std::vector<Taken> taken;
  taken.reserve(size);
  uint64_t bytes = 0;
  while (!stopped()) {
    Taken next = source->next();
    if (next && !*next) break;
    if (next) {
      bytes = std::max(bytes, bytesOf(**next));
      if (bytes > most_bytes / size)
        return Error{ErrorCode::kWrongUse, description + ": its " + std::to_string(size) + " frames take " +
                                               megabytes(bytes * size) + " of memory, at most " +
                                               megabytes(most_bytes) + " can be given: play a part of it"};
    }
    taken.push_back(std::move(next));
  }
  return std::unique_ptr<FrameSource>(std::make_unique<PreloadedSource>(description, size, std::move(taken)));
}

Result<std::unique_ptr<FrameSource>> preload(std::unique_ptr<FrameSource> source,
                                             const std::function<bool()>& stopped) {
  return preload(std::move(source), stopped, freeMemory() / 2);
}

}  // namespace comap
