#include "mapping_core/store/keyframe_runs.h"

namespace comap {

void KeyframeRuns::add(const KeyframeId& id, uint32_t group) {
  Runs& runs = sessions_[{id.robot, id.session}];
  last_ = sessions_.end();
  const auto after = runs.upper_bound(id.sequence);
  uint32_t first = id.sequence;
  Run run{id.sequence, group};
  if (after != runs.begin()) {
    const auto& [begin, before] = *std::prev(after);
    if (before.last >= id.sequence) return;  // it is there
    if (before.last + 1 == id.sequence && before.group == group) first = begin;
  }
  if (after != runs.end() && after->first == id.sequence + 1 && after->second.group == group) {
    run.last = after->second.last;
    runs.erase(after);
  }
  runs[first] = run;
}

std::optional<uint32_t> KeyframeRuns::groupOf(const KeyframeId& id) const {
  if (last_ == sessions_.end() || last_->first.second != id.session || last_->first.first != id.robot)
    last_ = sessions_.find({id.robot, id.session});
  if (last_ == sessions_.end()) return std::nullopt;
  const auto after = last_->second.upper_bound(id.sequence);
  if (after == last_->second.begin()) return std::nullopt;
  const Run& run = std::prev(after)->second;
  return run.last >= id.sequence ? std::optional(run.group) : std::nullopt;
}

}  // namespace comap
