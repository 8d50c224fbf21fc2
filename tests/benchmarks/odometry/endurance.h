// The odometry over hours in minutes: does its memory stay the same?
#pragma once

#include <functional>
#include <string>

#include "edge_agent/agent_config.h"
#include "protocol/types/result.h"
#include "tests/benchmarks/odometry/allocations.h"

namespace comap {

struct EnduranceSample {
  size_t frames = 0;
  double minutes = 0;    ///< of sensor time
  double memory_mb = 0;  ///< resident memory without the frames that are played
};

struct Endurance {
  EnduranceSample start, largest, end;  ///< start: after warm-up
  double frames_mb = 0;                 ///< of the frames that are played, not counted in the samples
  size_t keyframes = 0, poor = 0, lost = 0;
  double growth_percent() const { return 100 * (largest.memory_mb / start.memory_mb - 1); }
};

/// Plays the sequence to and fro, so that motion stays continuous, for `minutes` of sensor time at 30 frames a second,
/// as fast as it goes. Once there and back is warm-up: after it `counter` is reset, and after each tenth of the time
/// `told` is told. kWrongUse if `minutes` is not more than the warm-up; the errors of the source.
Result<Endurance> endure(const std::string& place, const AgentConfig& config, double minutes,
                         AllocationCounter& counter, const std::function<void(const EnduranceSample&)>& told);

}  // namespace comap
