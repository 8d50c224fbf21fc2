#include "tests/benchmarks/odometry/scores.h"

#include <algorithm>
#include <cstdlib>

namespace comap {
namespace {

constexpr double kDegrees = 180 / 3.14159265358979323846;
constexpr int64_t kSecond_ns = 1'000'000'000, kSlack_ns = 20'000'000;

Pose errorBetween(const PosePair& from, const PosePair& to) {
  const Pose truth = from.truth.pose.inverse() * to.truth.pose;
  return truth.inverse() * (from.estimate.pose.inverse() * to.estimate.pose);
}

std::vector<double> distancesAlong(const std::vector<PosePair>& pairs) {
  std::vector<double> along_m(pairs.size(), 0);
  for (size_t i = 1; i < pairs.size(); ++i)
    along_m[i] = along_m[i - 1] + (pairs[i].truth.pose.translation() - pairs[i - 1].truth.pose.translation()).norm();
  return along_m;
}

}  // namespace

RelativeError relativeErrorOverSecond(const std::vector<PosePair>& pairs) {
  std::vector<double> translation_m, rotation_deg;
  for (size_t i = 0, j = 0; i < pairs.size(); ++i) {
    const int64_t due_ns = pairs[i].estimate.stamp_ns + kSecond_ns;
    const auto gap = [&](size_t k) { return std::llabs(pairs[k].estimate.stamp_ns - due_ns); };
    while (j + 1 < pairs.size() && gap(j + 1) <= gap(j)) ++j;
    if (gap(j) > kSlack_ns) continue;
    const Pose error = errorBetween(pairs[i], pairs[j]);
    translation_m.push_back(error.translation().norm());
    rotation_deg.push_back(error.angle() * kDegrees);
  }
  RelativeError result;
  result.spans = translation_m.size();
  result.translation_median_m = quantileOf(translation_m, 0.5);
  result.translation_worst_m = quantileOf(translation_m, 1);
  result.rotation_median_deg = quantileOf(rotation_deg, 0.5);
  result.rotation_worst_deg = quantileOf(rotation_deg, 1);
  return result;
}

std::optional<double> driftPercent(const std::vector<PosePair>& pairs, double stretch_m) {
  const std::vector<double> along_m = distancesAlong(pairs);
  double sum = 0;
  size_t stretches = 0;
  for (size_t i = 0, j = 0; i < pairs.size(); ++i) {
    while (j < pairs.size() && along_m[j] - along_m[i] < stretch_m) ++j;
    if (j == pairs.size()) break;
    sum += errorBetween(pairs[i], pairs[j]).translation().norm() / (along_m[j] - along_m[i]);
    ++stretches;
  }
  if (stretches == 0) return std::nullopt;
  return 100 * sum / static_cast<double>(stretches);
}

double pathLength_m(const std::vector<PosePair>& pairs) { return pairs.empty() ? 0 : distancesAlong(pairs).back(); }

}  // namespace comap
