// Which group a keyframe is in, kept as runs of sequences: asked millions of times what a map of names would answer
// slowly.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>

#include "protocol/types/ids.h"

namespace comap {

/// Thread rule: one thread at a time, also for questions: it remembers where it looked last.
class KeyframeRuns {
 public:
  KeyframeRuns() = default;
  KeyframeRuns(const KeyframeRuns&) = delete;
  KeyframeRuns& operator=(const KeyframeRuns&) = delete;

  /// Each keyframe once.
  void add(const KeyframeId& id, uint32_t group = 0);
  /// Nothing if the keyframe is not known.
  std::optional<uint32_t> groupOf(const KeyframeId& id) const;
  bool contains(const KeyframeId& id) const { return groupOf(id).has_value(); }

 private:
  struct Run {
    uint32_t last = 0, group = 0;
  };
  using Runs = std::map<uint32_t, Run>;  // by first sequence
  using Sessions = std::map<std::pair<std::string, uint64_t>, Runs>;
  Sessions sessions_;
  mutable Sessions::const_iterator last_ = sessions_.end();  // where the last question was answered
};

}  // namespace comap
