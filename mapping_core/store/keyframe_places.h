// Where a keyframe stands in a list of many: asked millions of times what a map of names would answer slowly. Inside
// this folder only.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "mapping_core/store/kept_rows.h"
#include "mapping_core/store/store_survey.h"

namespace comap {

/// Thread rule: one thread at a time, also for questions: it remembers where it looked last.
class KeyframePlaces {
 public:
  /// Each keyframe once, in any order.
  explicit KeyframePlaces(const std::vector<WholeKeyframe>& keyframes);
  KeyframePlaces(const KeyframePlaces&) = delete;
  KeyframePlaces& operator=(const KeyframePlaces&) = delete;

  /// Nothing if the keyframe is not in the list.
  std::optional<uint32_t> placeOf(const KeyframeId& id) const;

 private:
  struct Place {
    uint32_t sequence = 0, place = 0;
    bool operator<(const Place& other) const { return sequence < other.sequence; }
  };
  using Places = std::vector<Place>;  // by sequence
  using Sessions = std::map<std::pair<std::string, uint64_t>, Places>;
  Sessions sessions_;
  mutable Sessions::const_iterator last_ = sessions_.end();
};

}  // namespace comap
