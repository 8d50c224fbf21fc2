// Several independent closures must agree before two maps become one: one match can be wrong, two that say
// the same from different places hardly ever.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "mapping_core/graph/closure.h"

namespace comap {

struct VoteOptions {
  size_t needed = 2;          ///< closures that share no keyframe
  double agree_m = 0.10;      ///< measured where the query stands, not at the far origin
  double agree_rad = 0.0873;  ///< 5 degrees
};

using Together = std::function<bool(const KeyframeId&, const KeyframeId&)>;

/// Whether two closures say the same of how two maps lie to each other; `b` is turned first if it runs the other way.
/// `together` tells whether two keyframes are in one of these maps. False if they join other maps.
bool agree(const Closure& a, const Closure& b, const Together& together, const std::map<KeyframeId, Pose>& T_map_cam,
           const VoteOptions& options);

/// Whether the map has the closure's keyframes where it says they are, both being in one map.
bool fits(const Closure& closure, const std::map<KeyframeId, Pose>& T_map_cam, const VoteOptions& options);

/// Whether two closures share no keyframe: those that do rest on the same picture.
bool independent(const Closure& a, const Closure& b);

/// Accepted closures between maps that are not one yet.
class VoteBox {
 public:
  explicit VoteBox(const VoteOptions& options) : options_(options) {}

  /// Adds a closure. Returns all pending closures between the same two maps that agree with it (itself first) once
  /// there are enough; they leave the box, turned so that their queries are in its query's map. `together` tells
  /// whether two keyframes are in one map; `T_map_cam` has the poses of all keyframes in their maps.
  std::optional<std::vector<Closure>> cast(const Closure& closure, const Together& together,
                                           const std::map<KeyframeId, Pose>& T_map_cam);
  /// A closure that was cast before and found no agreement: kept without looking for one.
  void keep(const Closure& closure) { pending_.push_back(closure); }
  /// Empties the box. Closures in the order in which they came.
  std::vector<Closure> takeAll() { return std::exchange(pending_, {}); }
  const std::vector<Closure>& all() const { return pending_; }
  size_t pending() const { return pending_.size(); }

 private:
  VoteOptions options_;
  std::vector<Closure> pending_;
};

}  // namespace comap
