#include "mapping_core/paper/active_region.h"

#include <cmath>

namespace comap {
namespace {

constexpr int kCoarse = 8;
constexpr float kBehind_m = 0.10f;

}  // namespace

Result<TimedView> ActiveRegion::predict(const CameraModel& model, const Pose& T_map_cam, SeenBy which) const {
  PredictionOptions prediction;
  prediction.min_confidence = options_.fusion.stable_confidence;
  return map_.predict(model, T_map_cam, prediction, filter(which));
}

Result<TimedView> ActiveRegion::predictActive(const Pose& T_map_cam) const {
  return predict(camera_.model, T_map_cam, SeenBy::kActive);
}

Result<TimedView> ActiveRegion::predictInactive(const Pose& T_map_cam) const {
  return predict(camera_.model, T_map_cam, SeenBy::kInactive);
}

Result<TimedView> ActiveRegion::predictAll(const Pose& T_map_cam) const {
  return predict(camera_.model, T_map_cam, SeenBy::kAny);
}

Result<double> ActiveRegion::inactiveShare(const Pose& T_map_cam) const {
  const auto view = predict(camera_.model.shrunk(kCoarse), T_map_cam, SeenBy::kInactive);
  if (!view) return view.error();
  size_t shown = 0;
  const Image<float>& depth = view->view.depth_m;
  for (size_t i = 0; i < depth.size(); ++i) shown += depth.data()[i] > 0;
  return static_cast<double>(shown) / static_cast<double>(std::max<size_t>(depth.size(), 1));
}

Result<void> ActiveRegion::reactivate(const Pose& T_map_cam, const Image<float>& active_m) const {
  const Pose T_cam_map = T_map_cam.inverse();
  const Eigen::Matrix3f R = T_cam_map.rotationMatrix().cast<float>();
  const Eigen::Vector3f t = T_cam_map.translation().cast<float>();
  return map_.rewrite([&](TimedSurfel& surfel) {
    if (surfel.surfel.confidence < options_.fusion.stable_confidence) return;
    const Eigen::Vector3f p = R * surfel.surfel.position + t;
    if (!(p.z() > 0.05f)) return;
    const Eigen::Vector2d at = camera_.model.project(p.cast<double>());
    const int u = static_cast<int>(std::lround(at.x())), v = static_cast<int>(std::lround(at.y()));
    if (!active_m.contains(u, v) || !(active_m.at(u, v) > 0) || p.z() >= active_m.at(u, v) + kBehind_m) return;
    surfel.seen[camera_.index] = static_cast<uint16_t>(tick_);
  });
}

}  // namespace comap
