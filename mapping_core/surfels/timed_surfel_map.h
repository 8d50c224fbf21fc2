// A dense map that several cameras track against at once: each surfel knows when each of them last saw it, so that
// every camera has an active part of its own. Otherwise as SurfelMap.
#pragma once

#include <functional>

#include "mapping_core/surfels/seen_times.h"
#include "mapping_core/surfels/surfel_map.h"

namespace comap {

struct TimedSurfel {
  Surfel surfel;
  SeenTimes seen{};
};

struct TimedView {
  PredictedView view;      ///< its `contributors` are empty
  Image<uint32_t> owners;  ///< of the surfel that each pixel with depth shows
};

/// Thread rule: as SurfelMap's. Owners are the caller's numbers; creation order within a map is buffer order until maps
/// are put together.
class TimedSurfelMap {
 public:
  /// `pool` must be timed.
  TimedSurfelMap(std::shared_ptr<SurfelPool> pool, const FusionParameters& parameters);
  TimedSurfelMap(TimedSurfelMap&&) noexcept;
  TimedSurfelMap& operator=(TimedSurfelMap&&) noexcept;
  ~TimedSurfelMap();

  /// As SurfelMap::fuse, with the surfels active for `now.camera` only; those updated or new are seen at `now.tick`.
  /// `unstable_timeout` counts ticks without an update by any camera. `now.which` is not looked at.
  Result<FusionReport> fuse(const CameraModel& camera, const ColourImage& colour, const DepthImage& depth,
                            const Pose& T_map_cam, uint32_t owner, const SeenFilter& now);
  /// As SurfelMap::predict, of the surfels that `seen` lets pass.
  Result<TimedView> predict(const CameraModel& camera, const Pose& T_map_cam, const PredictionOptions& options,
                            const SeenFilter& seen);

  /// Lets `change` alter position, normal and times of every surfel, in the order of the buffer; what else it changes
  /// is lost.
  Result<void> rewrite(const std::function<void(TimedSurfel& surfel)>& change);
  /// Takes all surfels of another map of the same pool, bit by bit, behind its own.
  void absorb(TimedSurfelMap&& other);

  /// All surfels in the order of the buffer.
  Result<std::vector<TimedSurfel>> download() const;
  size_t size() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace comap
