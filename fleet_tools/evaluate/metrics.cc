#include "fleet_tools/evaluate/metrics.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace comap {
namespace {

constexpr double kDegrees = 180 / 3.14159265358979323846;

class RpeSum {
 public:
  void add(const PosePair& from, const PosePair& to) {
    const Pose truth = from.truth.pose.inverse() * to.truth.pose;
    const Pose estimate = from.estimate.pose.inverse() * to.estimate.pose;
    const Pose error = truth.inverse() * estimate;
    translation_ += error.translation().squaredNorm();
    rotation_ += error.angle() * error.angle();
    ++count_;
  }
  std::optional<Rpe> result() const {
    if (count_ == 0) return std::nullopt;
    const auto n = static_cast<double>(count_);
    return Rpe{std::sqrt(translation_ / n), std::sqrt(rotation_ / n) * kDegrees, count_};
  }

 private:
  double translation_ = 0, rotation_ = 0;
  size_t count_ = 0;
};

}  // namespace

std::optional<Pose> alignRigid(const std::vector<PosePair>& pairs) {
  if (pairs.size() < 3) return std::nullopt;
  Eigen::Vector3d mean_p = Eigen::Vector3d::Zero(), mean_q = mean_p;
  for (const auto& pair : pairs) {
    mean_p += pair.estimate.pose.translation();
    mean_q += pair.truth.pose.translation();
  }
  mean_p /= static_cast<double>(pairs.size());
  mean_q /= static_cast<double>(pairs.size());
  Eigen::Matrix3d w = Eigen::Matrix3d::Zero();
  for (const auto& pair : pairs) {
    w += (pair.truth.pose.translation() - mean_q) * (pair.estimate.pose.translation() - mean_p).transpose();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(w, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  const Eigen::Matrix3d rotation = svd.matrixU() * Eigen::Vector3d(1, 1, sign).asDiagonal() * svd.matrixV().transpose();
  return Pose(rotation, mean_q - rotation * mean_p);
}

Ate errorUnder(const Pose& T_truth_estimate, const std::vector<PosePair>& pairs) {
  std::vector<double> errors;
  double sum = 0, squares = 0;
  for (const auto& pair : pairs) {
    const double error = (T_truth_estimate * pair.estimate.pose.translation() - pair.truth.pose.translation()).norm();
    errors.push_back(error);
    sum += error;
    squares += error * error;
  }
  std::sort(errors.begin(), errors.end());
  const auto n = static_cast<double>(errors.size());
  const size_t half = errors.size() / 2;
  const double median = errors.size() % 2 == 1 ? errors[half] : 0.5 * (errors[half - 1] + errors[half]);
  return {std::sqrt(squares / n), sum / n, median, errors.back(), errors.size(), T_truth_estimate};
}

std::optional<Ate> absoluteError(const std::vector<PosePair>& pairs) {
  const auto T_truth_estimate = alignRigid(pairs);
  if (!T_truth_estimate) return std::nullopt;
  return errorUnder(*T_truth_estimate, pairs);
}

std::optional<Ate> jointError(const std::vector<std::vector<PosePair>>& robots) {
  std::vector<PosePair> all;
  for (const auto& pairs : robots) all.insert(all.end(), pairs.begin(), pairs.end());
  return absoluteError(all);
}

std::optional<Rpe> relativeErrorPerFrame(const std::vector<PosePair>& pairs) {
  RpeSum sum;
  for (size_t i = 1; i < pairs.size(); ++i) sum.add(pairs[i - 1], pairs[i]);
  return sum.result();
}

std::optional<Rpe> relativeErrorPerSecond(const std::vector<PosePair>& pairs) {
  constexpr int64_t kSecond_ns = 1'000'000'000;
  RpeSum sum;
  size_t j = 0;
  for (const auto& pair : pairs) {
    const int64_t wanted = pair.estimate.stamp_ns + kSecond_ns;
    const auto gap = [&](size_t k) { return std::abs(pairs[k].estimate.stamp_ns - wanted); };
    while (j + 1 < pairs.size() && gap(j + 1) <= gap(j)) ++j;
    if (gap(j) <= kMaxAssociationGap_ns) sum.add(pair, pairs[j]);
  }
  return sum.result();
}

}  // namespace comap
