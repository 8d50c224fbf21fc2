// How far the pose that a robot believes is from the truth while it walks through what another has mapped.
#pragma once

#include <string>
#include <vector>

#include "mapping_core/gpu/device.h"
#include "protocol/types/result.h"

namespace comap {

struct DriftOptions {
  std::vector<std::string> mappers;  ///< DIR[@FIRST:LAST]; the map's frame is that of the first one's first camera
  std::string robot;
  int every = 1;  ///< of the robot's frames only every so many-th is played: a robot that moves fast for its camera
  /// The core answers every so many frames, and no more at all this many frames after the robot is in the map (0: it
  /// goes on).
  int answer_every = 1;
  int silent_after = 0;
  bool verbose = false;
};

/// Errors of the live pose against the truth, in the map's frame, from the frame on in which the core has joined the
/// robot to the map (DriftOptions::silent_after frames later, if that is set). Metres, degrees.
struct DriftErrors {
  double end_m = 0, rms_m = 0, median_m = 0, worst_m = 0, end_deg = 0;
};

struct DriftOutcome {
  size_t frames = 0;  ///< that count
  DriftErrors with_tiles, without_tiles, odometry;
  DriftErrors smooth;  ///< with tiles, as consumers see it
  uint32_t registered = 0, refused = 0;
  double corrected_m_mean = 0, corrected_m_worst = 0;
  double registration_ms_median = 0, registration_ms_p95 = 0, registration_ms_worst = 0;
};

/// Plays the same frames with tiles used and not used. kProblem if the robot never came into the map.
Result<DriftOutcome> measureDrift(gpu::Device& device, const DriftOptions& options);

}  // namespace comap
