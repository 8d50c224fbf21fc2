#include "mapping_core/service/presence_book.h"

#include <utility>

namespace comap {

Result<void> PresenceBook::resume() {
  auto presences = store_.presences();
  if (!presences) return presences.error();
  present_ = std::move(*presences);
  return {};
}

void PresenceBook::note(const std::string& robot, bool present) {
  const auto known = present_.find(robot);
  if (health_.refuses() || (known != present_.end() && known->second == present)) return;
  if (auto written = store_.setPresent(robot, present); !written)
    health_.note(written);
  else
    present_[robot] = present;
}

}  // namespace comap
