#include "tests/benchmarks/odometry/endurance.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "edge_agent/capture/source_uri.h"

namespace comap {
namespace {

constexpr double kFramesPerMinute = 30 * 60;
constexpr double kMegabyte = 1e6;

Result<std::vector<Frame>> loadAll(const std::string& place) {
  auto source = openSource(place);
  if (!source) return source.error();
  std::vector<Frame> frames;
  for (;;) {
    auto next = (*source)->next();
    if (!next) return next.error();
    if (!*next) return frames;
    frames.push_back(std::move(**next));
  }
}

double residentMb() {
  unsigned long size = 0, resident = 0;
  std::FILE* file = std::fopen("/proc/self/statm", "r");
  if (file == nullptr) return 0;
  const int read = std::fscanf(file, "%lu %lu", &size, &resident);
  std::fclose(file);
  return read == 2 ? static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE)) / kMegabyte : 0;
}

double sizeMb(const std::vector<Frame>& frames) {
  double bytes = 0;
  for (const Frame& frame : frames)
    bytes += static_cast<double>(frame.colour.size() * sizeof(Rgb) + frame.depth.size() * sizeof(uint16_t));
  return bytes / kMegabyte;
}

}  // namespace

Result<Endurance> endure(const std::string& place, const AgentConfig& config, double minutes,
                         AllocationCounter& counter, const std::function<void(const EnduranceSample&)>& told) {
  auto frames = loadAll(place);
  if (!frames) return frames.error();
  const auto all = static_cast<size_t>(std::ceil(minutes * kFramesPerMinute));
  const size_t loop = 2 * std::max<size_t>(frames->size(), 2) - 2;  // there and back, without doubling the ends
  if (all <= loop || frames->size() < 2)
    return Error{ErrorCode::kWrongUse, place + ": " + std::to_string(all) + " frames to play, expected more than the " +
                                           std::to_string(loop) + " of once there and back, which are warm-up"};
  OurOdometry odometry(config);
  odometry.attach(&counter);
  Endurance result;
  result.frames_mb = sizeMb(*frames);
  const auto sampleAt = [&](size_t done) {
    return EnduranceSample{done, static_cast<double>(done) / kFramesPerMinute, residentMb() - result.frames_mb};
  };
  for (size_t i = 0; i < all; ++i) {
    const size_t k = i % loop;
    Frame& frame = (*frames)[std::min(k, loop - k)];
    frame.stamp_ns = static_cast<int64_t>(i) * 1'000'000'000 / 30;
    const Step step = odometry.step(frame);
    result.keyframes += step.keyframe;
    result.poor += step.state == TrackingState::kPoor;
    result.lost += step.state == TrackingState::kLost;
    if (i + 1 == loop) {
      counter.reset();
      result.start = result.largest = sampleAt(i + 1);
      told(result.start);
    } else if (i >= loop && i % 100 == 0) {
      const EnduranceSample sample = sampleAt(i + 1);
      if (sample.memory_mb > result.largest.memory_mb) result.largest = sample;
    }
    if (i >= loop && (i + 1) * 10 / all != i * 10 / all) {
      result.end = sampleAt(i + 1);
      if (result.end.memory_mb > result.largest.memory_mb) result.largest = result.end;
      told(result.end);
    }
  }
  return result;
}

}  // namespace comap
