#include "edge_agent/odometry/recovery.h"

namespace comap {

Recovery::Outcome Recovery::attempt(const Pyramid& live, const FernCode& code) {
  const bool remembers = relocaliser_.memory().size() > 0;
  if (!remembers || attempts_ >= options_.patience_frames) return Outcome::kNewChain;
  ++attempts_;
  place_ = relocaliser_.relocalise(live, code);
  const std::optional<Pose> before = T_odom_unconfirmed_;
  T_odom_unconfirmed_.reset();
  if (!place_.accepted) return Outcome::kLost;
  const Pose T_odom_cam = place_.T_odom_keyframe * place_.T_keyframe_cam;
  if (before) {
    const Pose moved = before->inverse() * T_odom_cam;
    if (moved.translation().norm() < options_.confirm_m && moved.angle() < options_.confirm_rad) return Outcome::kFound;
  }
  T_odom_unconfirmed_ = T_odom_cam;
  return Outcome::kLost;
}

void Recovery::reset() {
  T_odom_unconfirmed_.reset();
  attempts_ = 0;
}

}  // namespace comap
