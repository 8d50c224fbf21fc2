// Where a robot's outbox is, and how it is opened at the start of its agent.
#pragma once

#include <functional>
#include <string>

#include "edge_agent/uplink/outbox.h"

namespace comap {

struct OutboxOptions {
  std::string kind = "disk";  ///< or "memory": what is not acknowledged is lost with the process
  /// Of all robots on this computer; made if it is not there. Empty: $STATE_DIRECTORY (which systemd sets), else
  /// $XDG_STATE_HOME/comap, else $HOME/.local/state/comap.
  std::string directory;
  uint32_t quota_mb = 2000;
};

/// In memory the quota is 256 MB at most.
uint64_t quotaBytes(const OutboxOptions& options);

/// The file of `robot`'s outbox; kWrongUse if no directory is given or known.
Result<std::string> outboxPath(const OutboxOptions& options, const std::string& robot);

struct BegunOutbox {
  Outbox outbox;
  uint64_t session = 0;    ///< of this start: durable
  uint32_t lost = 0;       ///< keyframes of earlier starts that were in it and are damaged
  bool more_lost = false;  ///< places of a damaged one could not be read: there may have been more
};

/// Opens or makes it, and begins a session (Outbox::beginSession). One that is damaged is put aside, and what can be
/// read of it taken over; `log` is told, also of a file without a byte, which is taken as new. kUnreachable, with what
/// to do, if its directory or file cannot be written, something else is there or another agent uses it; kWrongUse if it
/// is another robot's.
Result<BegunOutbox> openOutbox(const OutboxOptions& options, const std::string& robot, uint64_t wished_session,
                               const std::function<void(const std::string& line)>& log);

}  // namespace comap
