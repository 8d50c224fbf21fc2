// One start of an agent from its first word to its last: find the core, take frames, wait until all is delivered.
#pragma once

#include <chrono>
#include <functional>
#include <string>

#include "edge_agent/agent.h"

namespace comap {

struct RunOptions {
  bool realtime = false;  ///< a recording is played at its own speed, not as fast as the core keeps up
  bool live = false;      ///< frames come from a camera, which has a speed of its own
  bool offline = false;   ///< no core is waited for, nothing is delivered
  int patience_s = 60;    ///< without the core, where it is waited for
  std::string outbox;     ///< for people: its file; empty if it is in memory
  std::function<bool()> stopped = [] { return false; };  ///< asked often: whether to end early
  /// Called with each frame of a recording at its own speed that is done after it was due: by how much; the how
  /// manieth.
  std::function<void(std::chrono::nanoseconds behind, uint32_t frames)> late = [](auto, auto) {};
  std::function<void()> tell = [] {};  ///< called often, for those who watch over the agent
};

/// Runs the agent to the end of its source and until the core has mapped all, or it is stopped. `link` is the agent's,
/// `config` its configuration. kUnreachable if no core comes or it falls silent for `patience_s`; the text says what
/// waits. Other errors are the agent's.
Result<void> runAgent(Agent& agent, const Link& link, const AgentConfig& config, const RunOptions& options);

/// How many keyframes are not acknowledged and what becomes of them.
std::string whatWaits(const Agent& agent, const std::string& outbox);
/// Of those that the core holds, but which the outbox's disk did not let go of; empty if there are none.
std::string whatStays(const Agent& agent, const std::string& outbox);
/// Of those that were in an outbox that was damaged; `more_lost`: how many is not known. Empty if none is lost.
std::string whatIsLost(const Agent& agent, bool more_lost);

}  // namespace comap
