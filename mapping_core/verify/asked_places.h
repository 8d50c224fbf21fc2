// What need not be asked again: neighbouring keyframes see the same, so one of them says it for all. A place is where a
// keyframe stands and whither it looks.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "protocol/types/keyframe.h"
#include "protocol/types/pose.h"

namespace comap {

struct AskedPlacesOptions {
  /// Two keyframes nearer to each other than this see the same place. Of the house's 656 candidates 194 were refused
  /// within such a distance of another refused one of the same query, 1 was accepted.
  double same_m = 0.4, same_rad = 0.35;
};

/// Thread rule: one thread.
class AskedPlaces {
 public:
  explicit AskedPlaces(const AskedPlacesOptions& options) : options_(options) {}

  bool samePlace(const Pose& T_map_a, const Pose& T_map_b) const;

  /// The candidates that the keyframe before this one was refused, if it stood at the same place; those among them that
  /// `T_map_cam` knows. A keyframe that was not asked about a place says nothing of it, so at least every second is.
  std::vector<KeyframeId> refusedBefore(const Keyframe& keyframe, const std::map<KeyframeId, Pose>& T_map_cam) const;
  /// What a query was refused: forgets what its robot's queries were refused before, also in an earlier session.
  void note(const KeyframeId& query, std::vector<KeyframeId> refused);

 private:
  struct Query {
    KeyframeId id;
    std::vector<KeyframeId> refused;
  };
  AskedPlacesOptions options_;
  std::map<std::string, Query> last_;  // by robot
};

}  // namespace comap
