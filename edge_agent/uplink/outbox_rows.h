// How a keyframe's row stands in the outbox's tables. Inside the outbox only.
#pragma once

#include "edge_agent/uplink/outbox.h"
#include "protocol/storage/database.h"

/// What rowOf() reads, from left to right.
#define COMAP_OUTBOX_ROW_COLUMNS                                                                                       \
  "session, sequence, bytes, sent, thinned, skipped, linked, linked_to, odom_qx, odom_qy, odom_qz, odom_qw, odom_tx, " \
  "odom_ty, odom_tz, qx, qy, qz, qw, tx, ty, tz, information"

namespace comap {

/// What is wrong with it, the query's values() or next step() tells.
OutboxRow rowOf(Query& query);

}  // namespace comap
