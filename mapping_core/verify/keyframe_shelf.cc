#include "mapping_core/verify/keyframe_shelf.h"

namespace comap {

void KeyframeShelf::put(const Keyframe& keyframe) {
  auto view = makeKeyframeView(keyframe, depth_max_m_, noise_);
  sketches_.insert_or_assign(keyframe.id, makeSketch(keyframe, view->pyramid, noise_));
  views_.insert(std::move(view));
}

Result<std::shared_ptr<const KeyframeView>> KeyframeShelf::view(const KeyframeId& id) {
  if (auto view = views_.find(id)) return view;
  const auto keyframe = load_(id);
  if (!keyframe) return keyframe.error();
  auto view = makeKeyframeView(*keyframe, depth_max_m_, noise_);
  views_.insert(view);
  return view;
}

Result<const Sketch*> KeyframeShelf::sketch(const KeyframeId& id) {
  auto found = sketches_.find(id);
  if (found == sketches_.end()) {
    const auto keyframe = load_(id);
    if (!keyframe) return keyframe.error();
    auto view = views_.find(id);
    if (!view) {
      view = makeKeyframeView(*keyframe, depth_max_m_, noise_);
      views_.insert(view);
    }
    found = sketches_.emplace(id, makeSketch(*keyframe, view->pyramid, noise_)).first;
  }
  return &found->second;
}

}  // namespace comap
