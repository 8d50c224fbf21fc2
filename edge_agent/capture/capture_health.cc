#include "edge_agent/capture/capture_health.h"

#include <spdlog/fmt/fmt.h>

namespace comap {
namespace {

std::string stateText(const StreamHealth& stream) {
  const bool why = stream.state == StreamState::kGone && !stream.problem.empty();
  return toString(stream.state) + (why ? " (" + stream.problem + ")" : std::string());
}

}  // namespace

std::string toString(StreamState state) {
  switch (state) {
    case StreamState::kStarting:
      return "starting";
    case StreamState::kStreaming:
      return "streaming";
    case StreamState::kStalled:
      return "stalled";
    case StreamState::kGone:
      return "gone";
  }
  return "?";
}

std::string toString(const CaptureHealth& health) {
  const uint64_t jumps = health.colour.clock_jumps + health.depth.clock_jumps;
  return fmt::format("colour {}, depth {}; {} overtaken, {} unpaired, {} damaged, {} missed{}; one of {} taken{}",
                     stateText(health.colour), stateText(health.depth), health.overtaken, health.unpaired,
                     health.not_decoded + health.colour.damaged + health.depth.damaged,
                     health.colour.missed + health.depth.missed,
                     jumps > 0 ? fmt::format(", {} with a wrong time", jumps) : std::string(), health.every,
                     health.hottest_C ? fmt::format("; {:.0f} C", *health.hottest_C) : std::string());
}

}  // namespace comap
