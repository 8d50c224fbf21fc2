// Loops between maps: does what one camera sees lie in another frame of reference, and where?
#pragma once

#include <map>
#include <utility>

#include "mapping_core/paper/active_region.h"

namespace comap {

struct MapMatch {
  Pose T_other_own;  ///< takes points of the camera's map into the other one
  FrameTime place;   ///< of the other map, that was recognised
  Pose T_place_cam;  ///< of the camera that matched, in the camera of the place
  Fit fit;           ///< of the full-size views
};

/// Thread rule: one thread.
class InterMap {
 public:
  InterMap(const PaperOptions& options, const FernBook& book) : options_(options), book_(book) {}

  /// Looks for the active view of `camera`, as predicted last, among the places of `other`: coarse by ferns, then in
  /// full size against all that `other` shows there. With two votes wanted: only the second agreeing match counts.
  Result<std::optional<MapMatch>> find(const PaperCamera& camera, const std::string& own, ReferenceFrame& other,
                                       Registrar& registrar, uint32_t tick);

 private:
  bool agreesWithEarlier(const PaperCamera& camera, const std::string& own, const std::string& other, const Pose& T);

  const PaperOptions& options_;
  const FernBook& book_;
  struct Vote {
    Pose T_own_cam, T_other_own;
  };
  std::map<std::pair<std::string, std::string>, std::vector<Vote>> votes_;
};

}  // namespace comap
