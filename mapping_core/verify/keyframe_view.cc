#include "mapping_core/verify/keyframe_view.h"

#include <algorithm>

namespace comap {
namespace {

constexpr int kLevels = 4;
constexpr float kDepthMin_m = 0.3f;
constexpr ReferenceOptions kCoarse{2, 3, 1500};
constexpr ReferenceOptions kFine{1, 2, 6000};

}  // namespace

std::shared_ptr<const KeyframeView> makeKeyframeView(const Keyframe& keyframe, float depth_max_m,
                                                     const DepthNoiseModel& noise) {
  auto view = std::make_shared<KeyframeView>();
  view->id = keyframe.id;
  view->camera = keyframe.camera;
  buildPyramid(keyframe.colour, keyframe.depth, keyframe.camera, kLevels, kDepthMin_m, depth_max_m, view->pyramid);
  view->coarse = buildReference(view->pyramid, kCoarse, noise);
  view->fine = buildReference(view->pyramid, kFine, noise);
  // Nothing aligns at the full size, which is three quarters of what many views would hold.
  view->pyramid.front().grey = {};
  view->pyramid.front().depth_m = {};
  return view;
}

ReferenceView fineReference(const Pyramid& pyramid, const DepthNoiseModel& noise) {
  return buildReference(pyramid, kFine, noise);
}

std::shared_ptr<const KeyframeView> KeyframeViewCache::find(const KeyframeId& id) {
  const auto it = std::find_if(views_.begin(), views_.end(), [&](const auto& view) { return view->id == id; });
  if (it == views_.end()) return nullptr;
  views_.splice(views_.begin(), views_, it);
  return views_.front();
}

void KeyframeViewCache::insert(std::shared_ptr<const KeyframeView> view) {
  views_.push_front(std::move(view));
  if (views_.size() > capacity_) views_.pop_back();
}

}  // namespace comap
