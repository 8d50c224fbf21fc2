#include "edge_agent/uplink/outbox_rows.h"

#include <algorithm>

namespace comap {

OutboxRow rowOf(Query& query) {
  OutboxRow row;
  row.key.session = static_cast<uint64_t>(query.integer());
  row.key.sequence = query.unsigned32();
  row.bytes = static_cast<uint64_t>(query.integer());
  row.sent = query.integer() != 0;
  row.thinned = query.integer() != 0;
  row.skipped = query.unsigned32();
  row.link.linked = query.integer() != 0;
  row.link.linked_to = query.unsigned32();
  row.T_odom_cam = query.pose();
  row.link.T_link_this = query.pose();
  const auto information = query.bytes();
  if (information.size() == sizeof(double) * 36)
    std::copy(information.begin(), information.end(), reinterpret_cast<uint8_t*>(row.link.information.data()));
  return row;
}

}  // namespace comap
