// A keyframe made ready for alignment, as query (pyramid) and as reference (points); kept for the recently used ones.
#pragma once

#include <list>
#include <memory>

#include "mapping_core/rgbd/pyramid.h"
#include "mapping_core/rgbd/reference_view.h"
#include "protocol/types/keyframe.h"

namespace comap {

struct KeyframeView {
  KeyframeId id;
  CameraModel camera;
  Pyramid pyramid;       ///< levels 0..3, of 0 only the camera
  ReferenceView coarse;  ///< levels 3, 2: few points, for many seeds
  ReferenceView fine;    ///< levels 2, 1
};

/// Builds both sides. `depth_max_m` bounds what is aligned to.
std::shared_ptr<const KeyframeView> makeKeyframeView(const Keyframe& keyframe, float depth_max_m,
                                                     const DepthNoiseModel& noise);

/// The references of a predicted view: levels 2, 1.
ReferenceView fineReference(const Pyramid& pyramid, const DepthNoiseModel& noise);

/// The last `capacity` views, least recently used out first. Thread rule: one thread.
class KeyframeViewCache {
 public:
  explicit KeyframeViewCache(size_t capacity) : capacity_(capacity) {}
  /// Null if absent; a hit becomes the most recent.
  std::shared_ptr<const KeyframeView> find(const KeyframeId& id);
  void insert(std::shared_ptr<const KeyframeView> view);

 private:
  size_t capacity_;
  std::list<std::shared_ptr<const KeyframeView>> views_;  // most recent first
};

}  // namespace comap
