// Stored keyframes as matching needs them: views of the recently used ones, sketches of all that were asked for.
#pragma once

#include <functional>
#include <map>
#include <memory>

#include "mapping_core/verify/keyframe_view.h"
#include "mapping_core/verify/sketch.h"
#include "protocol/types/result.h"

namespace comap {

/// Thread rule: one thread.
class KeyframeShelf {
 public:
  /// Where keyframes come from that are not at hand.
  using Loader = std::function<Result<Keyframe>(const KeyframeId&)>;
  /// `views` = how many views are kept; `depth_max_m` bounds what is aligned to.
  KeyframeShelf(Loader load, size_t views, float depth_max_m, const DepthNoiseModel& noise)
      : load_(std::move(load)), depth_max_m_(depth_max_m), noise_(noise), views_(views) {}

  /// Makes view and sketch of a keyframe that is at hand, so that it need not be loaded.
  void put(const Keyframe& keyframe);
  /// Errors are the loader's.
  Result<std::shared_ptr<const KeyframeView>> view(const KeyframeId& id);
  /// Stays where it is as long as the shelf. Errors are the loader's.
  Result<const Sketch*> sketch(const KeyframeId& id);

 private:
  Loader load_;
  float depth_max_m_;
  DepthNoiseModel noise_;
  KeyframeViewCache views_;
  std::map<KeyframeId, Sketch> sketches_;
};

}  // namespace comap
