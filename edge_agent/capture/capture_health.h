// How a live camera does: states and counts, for logs and reports.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace comap {

enum class StreamState : uint8_t {
  kStarting,   ///< opened, no picture yet
  kStreaming,  ///< pictures come
  kStalled,    ///< opened, and no picture has come for a while
  kGone,       ///< unplugged or failed; it is tried again and again
};

/// "starting", "streaming", "stalled", "gone".
std::string toString(StreamState state);

struct StreamHealth {
  StreamState state = StreamState::kStarting;
  std::string problem;       ///< of a stream that is gone: why; else of the last damaged picture
  uint64_t taken = 0;        ///< pictures that came whole
  uint64_t damaged = 0;      ///< pictures the device or the way to it has spoilt
  uint64_t missed = 0;       ///< that the device has counted and that never came
  uint64_t repeated = 0;     ///< with the stamp of the one before: not taken
  uint64_t clock_jumps = 0;  ///< with a stamp that cannot be: one was made from the time of arrival
  uint64_t reopened = 0;     ///< times the device was opened again
  uint64_t stalls = 0;       ///< times it was open and gave nothing new for a while
};

struct CaptureHealth {
  StreamHealth colour, depth;
  uint64_t overtaken = 0;    ///< pairs that were passed over for a newer one
  uint64_t unpaired = 0;     ///< colour pictures without a depth picture near in time
  uint64_t not_decoded = 0;  ///< pairs of which a picture turned out damaged
  int every = 1;             ///< of so many pictures one is taken, so that the processor keeps up and stays cool
  std::optional<double> hottest_C = {};  ///< of the machine, if it tells
};

/// "colour streaming, depth gone (why); 3 overtaken, 1 unpaired, 0 damaged, 2 missed; one of 1 taken".
std::string toString(const CaptureHealth& health);

}  // namespace comap
