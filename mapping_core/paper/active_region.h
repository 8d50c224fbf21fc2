// The part of a map that one camera has lately been working on, and the rest.
#pragma once

#include "mapping_core/paper/paper_options.h"
#include "mapping_core/paper/reference_frame.h"

namespace comap {

class ActiveRegion {
 public:
  ActiveRegion(TimedSurfelMap& map, const PaperCamera& camera, const PaperOptions& options, uint32_t tick)
      : map_(map), camera_(camera), options_(options), tick_(tick) {}

  /// Stable surfels that this camera has seen within its window; those it has not; all.
  Result<TimedView> predictActive(const Pose& T_map_cam) const;
  Result<TimedView> predictInactive(const Pose& T_map_cam) const;
  Result<TimedView> predictAll(const Pose& T_map_cam) const;
  /// Share of the picture that shows inactive surfels, looked at coarsely.
  Result<double> inactiveShare(const Pose& T_map_cam) const;
  /// Makes active what the camera sees now: all stable surfels in view that do not lie farther than 10 cm behind
  /// `active_m`.
  Result<void> reactivate(const Pose& T_map_cam, const Image<float>& active_m) const;
  SeenFilter filter(SeenBy which) const { return {which, camera_.index, tick_, options_.active_window}; }

 private:
  Result<TimedView> predict(const CameraModel& model, const Pose& T_map_cam, SeenBy which) const;

  TimedSurfelMap& map_;
  const PaperCamera& camera_;
  const PaperOptions& options_;
  uint32_t tick_;
};

}  // namespace comap
