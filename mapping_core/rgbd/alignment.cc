#include "mapping_core/rgbd/alignment.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "mapping_core/rgbd/residuals.h"

namespace comap {
namespace {

constexpr size_t kLanes = 8;
constexpr float kTukey = 4.6f;    // of geometric residuals, in sigma
constexpr float kHuber = 1.345f;  // of photometric residuals, in their own scale
constexpr float kPhotoGateSigma = 4.0f;
constexpr size_t kFewestPoints = 60;

struct Brightness {
  float gain = 1, bias = 0;
};

struct LevelSums {
  Matrix6d a = Matrix6d::Zero();
  Vector6d b = Vector6d::Zero();
  double cost = 0;
  size_t visible = 0, compared = 0, inliers = 0, photometric = 0;
  double inlier_square_sum = 0;
  double photometric_median = 255;
  double depth_sum = 0;
};

void resize(AlignmentWorkspace& w, size_t n) {
  if (w.rg.size() >= n) return;
  for (auto* v : {&w.rg, &w.wg, &w.rp, &w.wp, &w.scratch}) v->resize(n);
  for (auto& v : w.jg) v.resize(n);
  for (auto& v : w.jp) v.resize(n);
}

// Residuals and rows of all points at one pose. Weight 0 marks points that do not count.
LevelSums evaluatePoints(const ReferencePoints& points, const PyramidLevel& frame, const Pose& T_ref_cur, float gate_m,
                         float extra_sigma_m, const Brightness& brightness, const DepthNoiseModel& noise,
                         AlignmentWorkspace& w) {
  LevelSums sums;
  const Eigen::Matrix3f r_rc = T_ref_cur.rotationMatrix().cast<float>();
  const Eigen::Vector3f t_rc = T_ref_cur.translation().cast<float>();
  const Eigen::Matrix3f r_cr = r_rc.transpose();
  const Eigen::Vector3f t_cr = -(r_cr * t_rc);
  const float fx = static_cast<float>(frame.camera.fx), fy = static_cast<float>(frame.camera.fy);
  const float cx = static_cast<float>(frame.camera.cx), cy = static_cast<float>(frame.camera.cy);
  const float ifx = 1 / fx, ify = 1 / fy;
  const int width = frame.grey.width();
  const float u_max = static_cast<float>(width) - 2.001f, v_max = static_cast<float>(frame.grey.height()) - 2.001f;
  const float* grey = frame.grey.data();
  const float* depth = frame.depth_m.data();

  for (size_t i = 0; i < points.x.size(); ++i) {
    w.wg[i] = 0;
    w.wp[i] = 0;
    w.rg[i] = 0;
    w.rp[i] = 0;
    const Eigen::Vector3f p(points.x[i], points.y[i], points.z[i]);
    const Eigen::Vector3f q = r_cr * p + t_cr;
    if (q.z() < 0.05f) continue;
    const float iz = 1 / q.z();
    const float u = fx * q.x() * iz + cx, v = fy * q.y() * iz + cy;
    if (!(u >= 1 && v >= 1 && u <= u_max && v <= v_max)) continue;
    ++sums.visible;
    const int un = static_cast<int>(u + 0.5f), vn = static_cast<int>(v + 0.5f);
    const float d = depth[vn * width + un];
    if (d <= 0) continue;
    const float sigma_live = noise.sigma(d);
    const float depth_gate = std::max(0.03f, kPhotoGateSigma * (sigma_live + points.sigma_m[i] + extra_sigma_m));
    const Eigen::Vector3f n(points.nx[i], points.ny[i], points.nz[i]);
    const bool has_normal = points.nx[i] != 0 || points.ny[i] != 0 || points.nz[i] != 0;

    if (has_normal) {
      const Eigen::Vector3f x_cur((static_cast<float>(un) - cx) * ifx * d, (static_cast<float>(vn) - cy) * ify * d, d);
      const Eigen::Vector3f x_ref = r_rc * x_cur + t_rc;
      const Eigen::Vector3f offset = x_ref - p;
      ++sums.compared;
      if (offset.squaredNorm() < gate_m * gate_m) {
        const float along = std::abs(n.dot(x_ref)) / x_ref.norm();
        const float sigma = std::sqrt(points.sigma_m[i] * points.sigma_m[i] + along * along * sigma_live * sigma_live +
                                      extra_sigma_m * extra_sigma_m);
        const float inv = 1 / sigma;
        const float r = n.dot(offset) * inv;
        const float share = r / kTukey;
        if (std::abs(share) < 1) {
          const float k = 1 - share * share;
          w.wg[i] = k * k;
          w.rg[i] = r;
          const Row6<float> row = geometricJacobian<float>(x_ref, n);
          for (int c = 0; c < 6; ++c) w.jg[c][i] = row(c) * inv;
          ++sums.inliers;
          sums.inlier_square_sum += r * r;
          sums.depth_sum += d;
        }
      }
    }
    if (std::abs(d - q.z()) < depth_gate) {
      const int u0 = static_cast<int>(u), v0 = static_cast<int>(v);
      const float a = u - static_cast<float>(u0), b = v - static_cast<float>(v0);
      const float* g = grey + v0 * width + u0;
      const float i00 = g[0], i10 = g[1], i01 = g[width], i11 = g[width + 1];
      const float value = (1 - b) * ((1 - a) * i00 + a * i10) + b * ((1 - a) * i01 + a * i11);
      // Gradient of the interpolated image itself, which is what the residual is made of.
      const float gx = (1 - b) * (i10 - i00) + b * (i11 - i01);
      const float gy = (1 - a) * (i01 - i00) + a * (i11 - i10);
      w.rp[i] = value - (brightness.gain * points.grey[i] + brightness.bias);
      const Row6<float> row = photometricJacobian<float>(p, q, r_rc, gx, gy, fx, fy);
      for (int c = 0; c < 6; ++c) w.jp[c][i] = row(c);
      w.wp[i] = 1;
      ++sums.photometric;
    }
  }
  return sums;
}

float medianAbsolutePhotometric(const ReferencePoints& points, AlignmentWorkspace& w) {
  size_t n = 0;
  for (size_t i = 0; i < points.x.size(); ++i)
    if (w.wp[i] > 0) w.scratch[n++] = std::abs(w.rp[i]);
  if (n == 0) return 255;
  std::nth_element(w.scratch.begin(), w.scratch.begin() + static_cast<long>(n / 2),
                   w.scratch.begin() + static_cast<long>(n));
  return w.scratch[n / 2];
}

// Weighted sums of J^T J and J^T r in fixed lanes: same bits whatever the vector width.
void accumulate(const std::vector<float> (&j)[6], const std::vector<float>& r, const std::vector<float>& weight,
                size_t n, LevelSums& sums) {
  float a[21][kLanes] = {}, b[6][kLanes] = {}, cost[kLanes] = {};
  for (size_t i = 0; i < n; i += kLanes) {
    int k = 0;
    for (int p = 0; p < 6; ++p) {
      float wj[kLanes];
      for (size_t l = 0; l < kLanes; ++l) wj[l] = weight[i + l] * j[p][i + l];
      for (size_t l = 0; l < kLanes; ++l) b[p][l] += wj[l] * r[i + l];
      for (int q = p; q < 6; ++q, ++k)
        for (size_t l = 0; l < kLanes; ++l) a[k][l] += wj[l] * j[q][i + l];
    }
    for (size_t l = 0; l < kLanes; ++l) cost[l] += weight[i + l] * r[i + l] * r[i + l];
  }
  int k = 0;
  for (int p = 0; p < 6; ++p) {
    for (const float v : b[p]) sums.b(p) += v;
    for (int q = p; q < 6; ++q, ++k) {
      double s = 0;
      for (const float v : a[k]) s += v;
      sums.a(p, q) += s;
      if (q != p) sums.a(q, p) += s;
    }
  }
  for (const float v : cost) sums.cost += v;
}

// Rows of points without weight must be finite zeros for the lane sums.
void clearUnused(AlignmentWorkspace& w, size_t n) {
  for (size_t i = 0; i < n; ++i) {
    if (w.wg[i] == 0)
      for (auto& column : w.jg) column[i] = 0;
    if (w.wp[i] == 0)
      for (auto& column : w.jp) column[i] = 0;
  }
}

// Least squares of grey_cur against grey_ref, held near (1, 0) so that textureless views cannot run away.
Brightness fitBrightness(const ReferencePoints& points, const Brightness& used, float scale, AlignmentWorkspace& w) {
  double sx = 0, sy = 0, sxx = 0, sxy = 0, s = 0;
  for (size_t i = 0; i < points.x.size(); ++i) {
    if (w.wp[i] == 0 || std::abs(w.rp[i]) > 3 * scale) continue;
    const double x = points.grey[i];
    const double y = w.rp[i] + used.gain * x + used.bias;
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

Matrix6d depthScaled(const Matrix6d& a, double depth_m) {
  Vector6d scale;
  scale << depth_m, depth_m, depth_m, 1, 1, 1;
  return scale.asDiagonal() * a * scale.asDiagonal();
}

// Step that leaves directions alone which the data do not constrain.
Vector6d solveConstrained(const LevelSums& sums, double depth_m, double weak_ratio) {
  const Matrix6d scaled = depthScaled(sums.a, depth_m);
  Vector6d scale;
  scale << depth_m, depth_m, depth_m, 1, 1, 1;
  const Vector6d rhs = -(scale.asDiagonal() * sums.b);
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(scaled);
  const double strongest = eigen.eigenvalues()(5);
  Vector6d step = Vector6d::Zero();
  for (int i = 0; i < 6; ++i) {
    if (eigen.eigenvalues()(i) <= weak_ratio * strongest) continue;
    step += eigen.eigenvectors().col(i) * (eigen.eigenvectors().col(i).dot(rhs) / eigen.eigenvalues()(i));
  }
  return scale.asDiagonal() * step;
}

}  // namespace

Alignment align(const ReferenceView& reference, const Pyramid& frame, const Pose& T_guess,
                const AlignmentOptions& options, AlignmentWorkspace& w) {
  Alignment result;
  result.T_ref_cur = T_guess;
  Brightness brightness;
  const size_t levels = reference.levels.size();
  for (size_t l = 0; l < levels; ++l) {
    const ReferencePoints& points = reference.levels[l];
    const PyramidLevel& level = frame[static_cast<size_t>(points.level)];
    resize(w, points.x.size());
    const double progress = levels > 1 ? static_cast<double>(l) / static_cast<double>(levels - 1) : 1.0;
    const float gate = static_cast<float>((1 - progress) * options.coarse_gate_m + progress * options.distance_gate_m);
    const float extra_sigma = static_cast<float>(1 - progress) * options.coarse_extra_sigma_m;
    const int iterations = options.iterations[std::min(l, options.iterations.size() - 1)];
    LevelSums sums;
    for (int i = 0; i < iterations; ++i) {
      sums = evaluatePoints(points, level, result.T_ref_cur, gate, extra_sigma, brightness, options.noise, w);
      if (sums.inliers + sums.photometric < kFewestPoints) return result;
      const float median = medianAbsolutePhotometric(points, w);
      sums.photometric_median = median;
      const float scale = std::clamp(1.4826f * median, 3.0f, 20.0f);
      const Brightness next = fitBrightness(points, brightness, scale, w);
      for (size_t k = 0; k < points.x.size(); ++k) {
        if (w.wp[k] == 0) continue;
        const float share = std::abs(w.rp[k]) / scale;
        w.wp[k] = options.photometric_weight * (share <= kHuber ? 1.0f : kHuber / share) / (scale * scale);
      }
      clearUnused(w, points.x.size());
      accumulate(w.jg, w.rg, w.wg, points.x.size(), sums);
      accumulate(w.jp, w.rp, w.wp, points.x.size(), sums);
      const double depth = sums.inliers > 0 ? sums.depth_sum / static_cast<double>(sums.inliers) : 1.0;
      const Vector6d step = solveConstrained(sums, depth, options.weak_ratio);
      if (!step.allFinite()) return result;
      result.T_ref_cur = Pose::exp(step) * result.T_ref_cur;
      brightness = next;
      ++result.iterations;
      if (step.head<3>().norm() < options.stop_m && step.tail<3>().norm() < options.stop_rad) break;
    }
    if (l + 1 < levels) continue;
    // The last linearisation is within one small step of the solution: its matrix is the information.
    const double depth = sums.inliers > 0 ? sums.depth_sum / static_cast<double>(sums.inliers) : 1.0;
    const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(depthScaled(sums.a, depth));
    result.degeneracy = eigen.eigenvalues()(5) > 0 ? std::max(0.0, eigen.eigenvalues()(0) / eigen.eigenvalues()(5)) : 0;
    result.weakest_direction = eigen.eigenvectors().col(0);
    result.information = sums.a / options.information_deflation;
    result.inlier_ratio =
        sums.compared > 0 ? static_cast<double>(sums.inliers) / static_cast<double>(sums.compared) : 0;
    result.overlap = points.count > 0 ? static_cast<double>(sums.visible) / static_cast<double>(points.count) : 0;
    result.rms_sigma = sums.inliers > 0 ? std::sqrt(sums.inlier_square_sum / static_cast<double>(sums.inliers)) : 1e9;
    result.photometric_median = sums.photometric_median;
    result.gain = brightness.gain;
    result.bias = brightness.bias;
    result.solved = true;
  }
  return result;
}

}  // namespace comap
