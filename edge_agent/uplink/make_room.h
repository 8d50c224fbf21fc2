// What goes when the outbox is full: first the finer colour, then the keyframes whose neighbours see nearly the same.
#pragma once

#include "edge_agent/uplink/outbox.h"

namespace comap {

struct RoomMade {
  uint32_t thinned = 0;
  /// Those dropped, with what they were linked to: a later keyframe that stands on one is to be joined to it.
  std::vector<OutboxRow> dropped;
  bool enough = true;  ///< false: nothing more may go, as all may be at the core already or have no successor here
};

/// Brings the outbox down to `quota_bytes`, in few steps at a time (a batch of thinned or dropped keyframes), each of
/// which is durable and leaves every remaining keyframe linked to one that exists:
/// 1. JPEG quality `thin_quality` for the oldest that were not sent: what the robot sees now is wanted most.
/// 2. Those not sent whose removal leaves the shortest motion between their neighbours: what stays is spread evenly.
///    What was linked to them is linked to what they were linked to.
/// `cursor` is where the next search for 2 begins; keep it between calls.
Result<RoomMade> makeRoom(Outbox& outbox, uint64_t quota_bytes, int thin_quality, OutboxKey& cursor);

}  // namespace comap
