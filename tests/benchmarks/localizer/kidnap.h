// A robot whose camera is covered and carried off: how soon it knows where it is in what others have mapped, and
// whether it ever believes a place that only looks like it.
#pragma once

#include <string>
#include <vector>

#include "mapping_core/gpu/device.h"
#include "protocol/types/result.h"

namespace comap {

struct KidnapOptions {
  std::vector<std::string> mappers;  ///< DIR[@FIRST:LAST]; the map's frame is that of the first one's first camera
  std::string own;                   ///< what the robot sees before
  int covered = 20;                  ///< frames
  std::string away;                  ///< what it sees after; in the mappers' part of the world, or elsewhere
  bool verbose = false;
};

struct KidnapOutcome {
  int frames = 0;                                  ///< after it was carried off
  int recognised_after = -1;                       ///< frames, -1 = not: a hypothesis
  int found_back_after = -1;                       ///< frames until it saw a place of its own memory
  int hypothesis_right = 0, hypothesis_wrong = 0;  ///< frames: within 0.1 m and 5 degrees, or not
  int right = 0, wrong = 0;                        ///< the same of frames placed in the map, with the core's word
  double error_m = 0;                              ///< median of the right ones
  int taken_back = 0;
  int joined_after = -1;  ///< frames until the core has joined the new chain to the map
  double search_ms_worst = 0;
};

/// The core goes on answering. kProblem if the robot was not in the mappers' map before it was carried off.
Result<KidnapOutcome> measureKidnap(gpu::Device& device, const KidnapOptions& options);

}  // namespace comap
