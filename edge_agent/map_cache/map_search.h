// Where in the tiles is a robot that does not know? Tiles bring the places that others have seen them from; the ones
// that look like the live view are tried, and only what several views agree on is believed.
#pragma once

#include <optional>
#include <vector>

#include "edge_agent/map_cache/map_registration.h"
#include "mapping_core/ferns/place_index.h"

namespace comap {

struct MapSearchOptions {
  size_t candidates = 4;  ///< places tried, the most similar first
  double max_dissimilarity = 0.45;
  /// Two places that are both accepted but say this much different poses: neither is believed.
  double ambiguous_m = 0.5, ambiguous_rad = 0.26;
  /// Views in a row that must pass, each from where the one before says that the camera is now; and how far apart the
  /// first and the last are at least, so that they do not all show the same things.
  int views = 3;
  double apart_m = 0.10, apart_rad = 0.09;
  double confirm_m = 0.15, confirm_rad = 0.175;  ///< how far a view may be from where it is expected
};

/// Thread rule: one thread.
class MapSearch {
 public:
  explicit MapSearch(const MapSearchOptions& options) : options_(options) {}

  /// Asks with one view: `T_odom_cam` tells how the camera has moved since the view before (not at all, if the robot is
  /// lost), `T_map_guess` where it was last believed to be, if it was. True if the place is confirmed: place() has it.
  bool attempt(const TileCache& cache, MapRegistration& registration, const Pyramid& live, const FernCode& code,
               const Pose& T_odom_cam, const std::optional<Pose>& T_map_guess);

  /// The last answer. Besides the registration's reasons: no_similar_place, ambiguous, unconfirmed.
  const Registration& place() const { return place_; }
  /// Whether a place waits to be confirmed by the next view.
  bool pending() const { return views_ > 0; }
  void reset() { views_ = 0; }

 private:
  Registration searchAll(const TileCache& cache, MapRegistration& registration, const Pyramid& live,
                         const FernCode& code, const std::optional<Pose>& T_map_guess);
  std::vector<Pose> candidates(const TileCache& cache, const FernCode& code) const;

  MapSearchOptions options_;
  Registration place_;
  int views_ = 0;
  Pose T_map_first_, T_odom_before_;
};

}  // namespace comap
