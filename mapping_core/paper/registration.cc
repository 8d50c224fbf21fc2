#include "mapping_core/paper/registration.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "mapping_core/rgbd/surface_normal.h"

namespace comap {
namespace {

constexpr float kDistance_m = 0.10f, kSine = 0.342f;
constexpr double kGeometryWeight = 100;
constexpr double kGatePixels = 640.0 * 480.0;
constexpr size_t kTurnLevel = kDenseLevels - 1;
// The published operator: slopes come out as this share of themselves, and those below the limit do not count.
constexpr float kSlopeShare = 0.46f, kLeastSlope = 10.9f;  // grey levels a pixel

}  // namespace

Fit fitOf(const Pyramid& reference, const Pyramid& frame, size_t level, const Pose& T_ref_cur,
          const Matrix6d& brightness) {
  const PyramidLevel &ref = reference[level], &cur = frame[level];
  const int reach = normalReach(static_cast<int>(level));
  const Eigen::Matrix3f R = T_ref_cur.rotationMatrix().cast<float>();
  const Eigen::Vector3f t = T_ref_cur.translation().cast<float>();
  Fit fit;
  double squares = 0;
  Matrix6d a = Matrix6d::Zero();
  for (int y = 0; y < cur.depth_m.height(); ++y)
    for (int x = 0; x < cur.depth_m.width(); ++x) {
      if (!(cur.depth_m.at(x, y) > 0)) continue;
      const Eigen::Vector3f p = R * pointAt(cur, x, y) + t;
      if (p.z() < 0.05f) continue;
      const Eigen::Vector2d at = ref.camera.project(p.cast<double>());
      const int u = static_cast<int>(std::lround(at.x())), v = static_cast<int>(std::lround(at.y()));
      if (!ref.depth_m.contains(u, v) || !(ref.depth_m.at(u, v) > 0)) continue;
      ++fit.compared;
      const Eigen::Vector3f offset = p - pointAt(ref, u, v);
      if (offset.squaredNorm() > kDistance_m * kDistance_m) continue;
      const Eigen::Vector3f n = normalAt(ref, u, v, reach), m = R * normalAt(cur, x, y, reach);
      if (n.isZero() || m.isZero() || n.dot(m) <= 0 || n.cross(m).squaredNorm() > kSine * kSine) continue;
      ++fit.inliers;
      const double r = n.dot(offset);
      squares += r * r;
      Vector6d row;
      row << n.cast<double>(), p.cross(n).cast<double>();
      a.selfadjointView<Eigen::Lower>().rankUpdate(row, kGeometryWeight);
    }
  if (fit.inliers == 0) return fit;
  const auto count = static_cast<double>(fit.inliers);
  fit.rms_m = std::sqrt(squares / count);
  fit.error = std::sqrt(squares) / count;
  const Matrix6d full = Matrix6d(a.selfadjointView<Eigen::Lower>()) + brightness;
  const Eigen::FullPivLU<Matrix6d> lu(full);
  fit.worst_variance =
      lu.isInvertible() ? lu.inverse().eval().diagonal().maxCoeff() : std::numeric_limits<double>::max();
  return fit;
}

bool passes(const Fit& fit, const ClosureGates& gates, const CameraModel& camera, bool independent) {
  const double scale = static_cast<double>(camera.width) * camera.height / kGatePixels;
  if (static_cast<double>(fit.inliers) <= gates.inliers * scale || fit.worst_variance > gates.variance / scale)
    return false;
  if (!independent) return fit.error < gates.error / std::sqrt(scale);
  constexpr double kRms_m = 0.015, kInlierRatio = 0.35;
  if (fit.rms_m >= kRms_m) return false;
  return static_cast<double>(fit.inliers) > kInlierRatio * static_cast<double>(fit.compared);
}

Registrar::Registrar(const PaperOptions& options) : joint_covariance_(options.fixes.joint_covariance) {
  const DenseOptions& chosen = options.dense;
  if (options.fixes.noise_weights) {
    // Both views have noise.
    const double sigma_m = noise_.sigma(static_cast<float>(chosen.typical_depth_m));
    options_.photometric_weight = static_cast<float>(chosen.brightness_weight / (2 * sigma_m * sigma_m));
  } else {
    noise_ = {0, 0};
    options_.extra_sigma_m = 1;
    options_.photometric_weight = static_cast<float>(chosen.brightness_weight);
  }
  if (!options.fixes.brightness_gate) options_.photometric_gate_m = static_cast<float>(chosen.brightness_gate_m);
  options_.iterations = {4, 5, 10};
  options_.distance_gate_m = kDistance_m;
  options_.coarse_gate_m = kDistance_m;
  options_.noise = noise_;
  if (!options.fixes.free_directions) options_.weak_ratio = 0;
  small_options_ = options_;
  small_options_.iterations = {10};
  small_options_.photometric_weight = 0;
}

Alignment Registrar::align(const Pyramid& reference, const Pyramid& frame, const Pose& T_guess) {
  constexpr ReferenceOptions kDense{0, kDenseLevels - 1, std::numeric_limits<int>::max()};
  buildReference(reference, kDense, noise_, nullptr, picked_, reference_);
  return comap::align(reference_, frame, T_guess, options_, workspace_);
}

std::optional<RegisteredView> Registrar::registerViews(const Pyramid& reference, const Pyramid& frame) {
  const Alignment aligned = align(reference, frame, Pose());
  if (!aligned.solved) return std::nullopt;
  const Matrix6d brightness = joint_covariance_ ? brightnessMatrix(frame, aligned) : Matrix6d::Zero();
  return RegisteredView{aligned.T_ref_cur, fitOf(reference, frame, 0, aligned.T_ref_cur, brightness)};
}

// J^T J of brightness at the pose found, each row scaled by 1 / (s + |r|), s being the residuals' root mean square.
Matrix6d Registrar::brightnessMatrix(const Pyramid& frame, const Alignment& aligned) {
  const ReferencePoints& points = reference_.levels.back();
  AssociationGates gates;
  gates.distance_m = kDistance_m;
  gates.extra_sigma_m = options_.extra_sigma_m;
  gates.photometric_m = options_.photometric_gate_m;
  evaluateResiduals(points, frame[static_cast<size_t>(points.level)], aligned.T_ref_cur, gates,
                    {static_cast<float>(aligned.gain), static_cast<float>(aligned.bias)}, noise_, workspace_);
  const auto counts = [&](size_t i) {
    return workspace_.wp[i] > 0 &&
           points.gx[i] * points.gx[i] + points.gy[i] * points.gy[i] >= kLeastSlope * kLeastSlope;
  };
  double squares = 0;
  size_t count = 0;
  for (size_t i = 0; i < points.count; ++i) {
    if (!counts(i)) continue;
    squares += workspace_.rp[i] * workspace_.rp[i];
    ++count;
  }
  Matrix6d sum = Matrix6d::Zero();
  if (count == 0) return sum;
  const double rms = std::max(1.0, std::sqrt(squares / static_cast<double>(count)));
  for (size_t i = 0; i < points.count; ++i) {
    if (!counts(i)) continue;
    Vector6d row;
    for (int c = 0; c < 6; ++c) row(c) = workspace_.jp[c][i];
    const double scale = kSlopeShare / (rms + std::abs(workspace_.rp[i]));
    sum.selfadjointView<Eigen::Lower>().rankUpdate(row, scale * scale);
  }
  return sum.selfadjointView<Eigen::Lower>();
}

Alignment Registrar::alignSmall(const Pyramid& reference, const Pyramid& frame) {
  constexpr ReferenceOptions kSmall{kSmallLevel, kSmallLevel, std::numeric_limits<int>::max()};
  buildReference(reference, kSmall, noise_, nullptr, picked_, reference_);
  return comap::align(reference_, frame, Pose(), small_options_, workspace_);
}

Pose Registrar::turn(const Pyramid& previous, const Pyramid& current) {
  const PyramidLevel& level = current[kTurnLevel];
  const RotationAlignment turned = alignRotation(level.camera, previous[kTurnLevel].grey, level.grey,
                                                 Eigen::Matrix3d::Identity(), {}, rotation_workspace_);
  if (!turned.usable) return {};
  return {turned.R_previous_current, Eigen::Vector3d::Zero()};
}

}  // namespace comap
