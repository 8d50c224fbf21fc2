#include "mapping_core/rgbd/alignment.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "mapping_core/rgbd/constraints.h"

namespace comap {
namespace {

constexpr float kHuber = 1.345f;           // of photometric residuals, in their own scale
constexpr float kSigmaOfMedian = 1.4826f;  // of normally distributed residuals
constexpr size_t kFewestPoints = 60;
constexpr double kHopeless = 1e-4;       // weaker directions would only be pushed about by rounding and noise
constexpr float kGradientNoise = 10.6f;  // squares of gradients up to so many variances of grey are noise

// Median of |photometric residual| over the points that count and that `use` takes, by counting in steps of an eighth
// of a grey level: finer than the pictures are. Nothing if there are none.
template <class Use>
std::optional<float> medianAbsolutePhotometric(size_t points, const PointResiduals& residuals, const Use& use) {
  constexpr float kStepsPerGrey = 8;
  std::array<uint32_t, 8 * 256> histogram{};
  uint32_t all = 0;
  for (size_t i = 0; i < points; ++i) {
    if (residuals.wp[i] == 0 || !use(i)) continue;
    const auto bin = static_cast<size_t>(std::abs(residuals.rp[i]) * kStepsPerGrey);
    ++histogram[std::min(bin, histogram.size() - 1)];
    ++all;
  }
  if (all == 0) return std::nullopt;
  uint32_t below = 0;
  size_t bin = 0;
  while ((below += histogram[bin]) * 2 <= all) ++bin;
  return (static_cast<float>(bin) + 0.5f) / kStepsPerGrey;
}

// Variance of grey in one picture: where the reference is flattest, residuals are made of noise alone, that of both
// pictures. Half of the points with the weakest gradients in their cells serve.
float squareOfNoise(const ReferencePoints& points, const PointResiduals& residuals) {
  const auto flat = [&](size_t i) {
    return points.gx[i] * points.gx[i] + points.gy[i] * points.gy[i] <= points.median_gradient_square;
  };
  const float sigma = kSigmaOfMedian * medianAbsolutePhotometric(points.count, residuals, flat).value_or(0);
  return sigma * sigma / 2;
}

// Least squares of grey_cur against grey_ref, held near (1, 0) so that textureless views cannot run away.
Brightness fitBrightness(const ReferencePoints& points, const Brightness& used, float scale,
                         const PointResiduals& residuals) {
  double sx = 0, sy = 0, sxx = 0, sxy = 0, s = 0;
  for (size_t i = 0; i < points.x.size(); ++i) {
    if (residuals.wp[i] == 0 || std::abs(residuals.rp[i]) > 3 * scale) continue;
    const double x = points.grey[i];
    const double y = residuals.rp[i] + used.gain * points.grey[i] + used.bias;
    s += 1;
    sx += x;
    sy += y;
    sxx += x * x;
    sxy += x * y;
  }
  if (s < static_cast<double>(kFewestPoints)) return used;
  const double mx = sx / s, my = sy / s;
  const double vxx = sxx / s - mx * mx, vxy = sxy / s - mx * my;
  constexpr double kPriorVariance = 100;  // grey levels squared: the spread at which data and prior weigh the same
  const double gain = std::clamp((vxy + kPriorVariance) / (vxx + kPriorVariance), 0.5, 2.0);
  return {static_cast<float>(gain), static_cast<float>(my - gain * mx)};
}

Vector6d depthScale(double depth_m) {
  Vector6d scale;
  scale << depth_m, depth_m, depth_m, 1, 1, 1;
  return scale;
}

Matrix6d depthScaled(const Matrix6d& a, double depth_m) {
  const Vector6d scale = depthScale(depth_m);
  return scale.asDiagonal() * a * scale.asDiagonal();
}

// The directions of the camera's motion, weakest first, and how well the views determine each.
struct Constraints {
  Eigen::SelfAdjointEigenSolver<Matrix6d> eigen;  // of the depth-scaled information
  double depth_m = 1;
  int free = 0;  // how many of the weakest directions are not determined

  Constraints(const Matrix6d& a, double depth, double weak_ratio) : eigen(depthScaled(a, depth)), depth_m(depth) {
    while (free < 6 && eigen.eigenvalues()(free) <= weak_ratio * eigen.eigenvalues()(5)) ++free;
  }
};

// The pose without what the solver did in directions that nothing determines: there it followed noise.
Pose keepGuessWhereFree(const Constraints& constraints, const Pose& T_guess, const Pose& T_solved) {
  if (constraints.free == 0) return T_solved;
  const Vector6d scale = depthScale(constraints.depth_m);
  Vector6d increment = (T_solved * T_guess.inverse()).log().cwiseQuotient(scale);
  const auto free = constraints.eigen.eigenvectors().leftCols(constraints.free);
  increment -= free * (free.transpose() * increment).eval();
  return Pose::exp(increment.cwiseProduct(scale)) * T_guess;
}

// Gauss-Newton step within the determined directions.
Vector6d solveConstrained(const NormalEquations& sums, const Constraints& constraints) {
  const Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, 6> basis =
      depthScale(constraints.depth_m).asDiagonal() * constraints.eigen.eigenvectors().rightCols(6 - constraints.free);
  if (basis.cols() == 0) return Vector6d::Zero();
  const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 6, 6> a = basis.transpose() * sums.a * basis;
  const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1> b = basis.transpose() * sums.b;
  return basis * a.ldlt().solve(-b);
}

void describeConstraints(const Constraints& constraints, const AlignmentOptions& options, Alignment& result) {
  const auto& values = constraints.eigen.eigenvalues();
  const auto& directions = constraints.eigen.eigenvectors();
  result.degeneracy = values(5) > 0 ? std::max(0.0, values(0) / values(5)) : 0;
  result.weakest_direction = directions.col(0);
  result.free_directions = constraints.free;
  Vector6d information = values.cwiseMax(0) / options.information_deflation;
  for (int i = 0; i < constraints.free; ++i) information(i) = 1 / (options.free_sigma * options.free_sigma);
  const Matrix6d scaled = directions * information.asDiagonal() * directions.transpose();
  result.information = depthScaled(scaled, 1 / constraints.depth_m);
  result.information = 0.5 * (result.information + result.information.transpose()).eval();
}

}  // namespace

Alignment align(const ReferenceView& reference, const Pyramid& frame, const Pose& T_guess,
                const AlignmentOptions& options, PointResiduals& residuals) {
  Alignment result;
  result.T_ref_cur = T_guess;
  Brightness brightness;
  const size_t levels = reference.levels.size();
  for (size_t l = 0; l < levels; ++l) {
    const ReferencePoints& points = reference.levels[l];
    const PyramidLevel& level = frame[static_cast<size_t>(points.level)];
    const size_t size = points.x.size();
    const double progress = levels > 1 ? static_cast<double>(l) / static_cast<double>(levels - 1) : 1.0;
    AssociationGates gates;
    gates.distance_m = static_cast<float>((1 - progress) * options.coarse_gate_m + progress * options.distance_gate_m);
    gates.extra_sigma_m = options.extra_sigma_m + static_cast<float>(1 - progress) * options.coarse_extra_sigma_m;
    gates.photometric_m = options.photometric_gate_m;
    const int iterations = options.iterations[std::min(l, options.iterations.size() - 1)];
    ResidualCounts counts;
    NormalEquations sums;
    double depth = 1;
    float photometric_median = 255;
    for (int i = 0; i < iterations; ++i) {
      counts = evaluateResiduals(points, level, result.T_ref_cur, gates, brightness, options.noise, residuals);
      if (counts.inliers + counts.photometric < kFewestPoints) return result;
      photometric_median = medianAbsolutePhotometric(size, residuals, [](size_t) { return true; }).value_or(255);
      const float scale = std::clamp(kSigmaOfMedian * photometric_median, 3.0f, 20.0f);
      const Brightness next = fitBrightness(points, brightness, scale, residuals);
      // Residuals tell of noise only where the views lie right on each other.
      const float noise_square = l + 1 == levels ? squareOfNoise(points, residuals) : 0;
      weighPhotometric(size, {scale, kHuber, options.photometric_weight, kGradientNoise * noise_square}, residuals);
      sums = sumNormalEquations(size, residuals);
      if (counts.inliers > 0) depth = counts.depth_sum / static_cast<double>(counts.inliers);
      const Vector6d step = solveConstrained(sums, Constraints(sums.a, depth, kHopeless));
      if (!step.allFinite()) return result;
      result.T_ref_cur = Pose::exp(step) * result.T_ref_cur;
      brightness = next;
      ++result.iterations;
      if (step.head<3>().norm() < options.stop_m && step.tail<3>().norm() < options.stop_rad) break;
    }
    if (l + 1 < levels) continue;
    // The last linearisation is within one small step of the solution: its matrix is the information.
    const auto share = [](size_t part, size_t whole) {
      return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0.0;
    };
    const Constraints constraints(
        sumConstraints(points, level, result.T_ref_cur, options.noise, gates.extra_sigma_m, residuals), depth,
        options.weak_ratio);
    result.T_ref_cur = keepGuessWhereFree(constraints, T_guess, result.T_ref_cur);
    describeConstraints(constraints, options, result);
    result.inlier_ratio = share(counts.inliers, counts.compared);
    result.overlap = share(counts.visible, points.count);
    result.rms_sigma =
        counts.inliers > 0 ? std::sqrt(counts.inlier_square_sum / static_cast<double>(counts.inliers)) : 1e9;
    result.photometric_median = photometric_median;
    result.gain = brightness.gain;
    result.bias = brightness.bias;
    result.solved = true;
  }
  return result;
}

}  // namespace comap
