#include "mapping_core/rgbd/rotation_alignment.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace comap {
namespace {

using Vector5d = Eigen::Matrix<double, 5, 1>;
using Matrix5d = Eigen::Matrix<double, 5, 5>;

constexpr int kLanes = 8;
constexpr int kBorder = 1;
constexpr int kShortestSide_px = 8;
constexpr float kHuber = 1.345f;
constexpr double kSigmaOfMeanAbsolute = 1.2533;  // of normally distributed residuals
constexpr double kSmallestScale_grey = 1, kLargestScale_grey = 40;
constexpr float kMost_grey = 40;  // what one pixel may add to a mean: things that move are few but far off
constexpr int kShift = 3;         // the search by whole pixels goes as far as 1/3 of the picture
constexpr double kLargestGain = 2;

// Read-only: one level of both pictures.
struct Pair {
  const CameraModel& camera;
  const Image<float>& previous;
  const Image<float>& current;
};

// What is estimated: grey_current = gain grey_previous + bias.
struct Estimate {
  Eigen::Matrix3d R_current_previous = Eigen::Matrix3d::Identity();
  double gain = 1, bias = 0;
};

struct Sums {
  Matrix5d a = Matrix5d::Zero();  // of (phi, gain, bias)
  Vector5d b = Vector5d::Zero();
  double mean_error = 255, overlap = 0, weight = 0;
};

struct Fit {
  Estimate estimate;
  Sums sums;
};

void resize(Image<float>& image, int width, int height) {
  if (image.width() != width || image.height() != height) image = Image<float>(width, height);
}

void halve(const Image<float>& in, Image<float>& out) {
  resize(out, in.width() / 2, in.height() / 2);
  for (int y = 0; y < out.height(); ++y) {
    const float* a = in.row(2 * y);
    const float* b = in.row(2 * y + 1);
    float* o = out.row(y);
    for (int x = 0; x < out.width(); ++x) o[x] = 0.25f * (a[2 * x] + a[2 * x + 1] + b[2 * x] + b[2 * x + 1]);
  }
}

double mean(const Image<float>& image) {
  double sum = 0;
  for (size_t i = 0; i < image.size(); ++i) sum += image.data()[i];
  return sum / static_cast<double>(image.size());
}

double meanDeviation(const Image<float>& image) {
  const float centre = static_cast<float>(mean(image));
  double sum = 0;
  for (size_t i = 0; i < image.size(); ++i) sum += std::min(kMost_grey, std::abs(image.data()[i] - centre));
  return sum / static_cast<double>(image.size());
}

// Eight pixels side by side, in arrays that the compiler turns into vector registers.
struct Lanes {
  float mx[kLanes], my[kLanes], s[kLanes], t[kLanes], i00[kLanes], i10[kLanes], i01[kLanes], i11[kLanes];
  float grey[kLanes], dx[kLanes], dy[kLanes], seen[kLanes];
};

// Where the previous picture's pixels from (x, y) on end in the current one, and what is seen there.
void sample(const Pair& pair, const Eigen::Matrix3f& r, int x, int y, Lanes& lanes) {
  const int width = pair.previous.width();
  const float fx = static_cast<float>(pair.camera.fx), fy = static_cast<float>(pair.camera.fy);
  const float cx = static_cast<float>(pair.camera.cx), cy = static_cast<float>(pair.camera.cy);
  const float u_max = static_cast<float>(width) - 2.001f;
  const float v_max = static_cast<float>(pair.previous.height()) - 2.001f;
  const float ry = (static_cast<float>(y) - cy) / fy;
  const Eigen::Vector3f base = r.col(1) * ry + r.col(2);
  const float first = static_cast<float>(x);
  float u[kLanes], v[kLanes];
  for (int l = 0; l < kLanes; ++l) {
    const float rx = (first + static_cast<float>(l) - cx) / fx;
    const float qz = std::max(0.1f, r(2, 0) * rx + base.z()), iz = 1 / qz;
    lanes.mx[l] = (r(0, 0) * rx + base.x()) * iz;
    lanes.my[l] = (r(1, 0) * rx + base.y()) * iz;
    u[l] = fx * lanes.mx[l] + cx;
    v[l] = fy * lanes.my[l] + cy;
  }
  const float* previous = pair.previous.row(y);
  for (int l = 0; l < kLanes; ++l) {
    const bool seen = x + l < width - kBorder && u[l] >= 1 && v[l] >= 1 && u[l] <= u_max && v[l] <= v_max;
    const int u0 = seen ? static_cast<int>(u[l]) : 1, v0 = seen ? static_cast<int>(v[l]) : 1;
    const float* g = pair.current.row(v0) + u0;
    lanes.i00[l] = g[0];
    lanes.i10[l] = g[1];
    lanes.i01[l] = g[width];
    lanes.i11[l] = g[width + 1];
    lanes.s[l] = seen ? u[l] - static_cast<float>(u0) : 0;
    lanes.t[l] = seen ? v[l] - static_cast<float>(v0) : 0;
    const float* p = previous + std::min(x + l, width - 1 - kBorder);
    lanes.grey[l] = p[0];
    lanes.dx[l] = 0.5f * (p[1] - p[-1]);
    lanes.dy[l] = 0.5f * (p[width] - p[-width]);
    lanes.seen[l] = seen ? 1.0f : 0.0f;
  }
}

// Normal equations at one estimate; residuals beyond Huber's limit of `scale` pull with constant force.
Sums evaluate(const Pair& pair, const Estimate& estimate, double scale) {
  const int width = pair.previous.width(), height = pair.previous.height();
  const float fx = static_cast<float>(pair.camera.fx), fy = static_cast<float>(pair.camera.fy);
  const float gain = static_cast<float>(estimate.gain), bias = static_cast<float>(estimate.bias);
  const float limit = kHuber * static_cast<float>(scale);
  const Eigen::Matrix3f r = estimate.R_current_previous.cast<float>();
  Sums sums;
  double error = 0, seen = 0;
  Lanes lanes;
  for (int y = kBorder; y < height - kBorder; ++y) {
    // Of one row: floats stay exact enough.
    float a[15][kLanes] = {}, b[5][kLanes] = {}, errors[kLanes] = {}, weights[kLanes] = {}, counts[kLanes] = {};
    for (int x = kBorder; x < width - kBorder; x += kLanes) {
      sample(pair, r, x, y, lanes);
      float j[5][kLanes], residual[kLanes], weight[kLanes];
      for (int l = 0; l < kLanes; ++l) {
        const float s = lanes.s[l], t = lanes.t[l];
        const float top = lanes.i00[l] + s * (lanes.i10[l] - lanes.i00[l]);
        const float bottom = lanes.i01[l] + s * (lanes.i11[l] - lanes.i01[l]);
        const float live_dx = (1 - t) * (lanes.i10[l] - lanes.i00[l]) + t * (lanes.i11[l] - lanes.i01[l]);
        residual[l] = top + t * (bottom - top) - (gain * lanes.grey[l] + bias);
        const float size = std::abs(residual[l]);
        weight[l] = lanes.seen[l] * limit / std::max(limit, size);
        // Mean of both pictures' gradients: its error is of second order in the turn that is still missing.
        const auto turn = rotationJacobian<float>(lanes.mx[l], lanes.my[l], 0.5f * (live_dx + gain * lanes.dx[l]),
                                                  0.5f * (bottom - top + gain * lanes.dy[l]), fx, fy);
        j[0][l] = turn[0];
        j[1][l] = turn[1];
        j[2][l] = turn[2];
        j[3][l] = -lanes.grey[l];
        j[4][l] = -1;
        errors[l] += lanes.seen[l] * std::min(kMost_grey, size);
        weights[l] += weight[l];
        counts[l] += lanes.seen[l];
      }
      for (int p = 0, k = 0; p < 5; ++p) {
        float wj[kLanes];
        for (int l = 0; l < kLanes; ++l) wj[l] = weight[l] * j[p][l];
        for (int l = 0; l < kLanes; ++l) b[p][l] += wj[l] * residual[l];
        for (int q = p; q < 5; ++q, ++k)
          for (int l = 0; l < kLanes; ++l) a[k][l] += wj[l] * j[q][l];
      }
    }
    const auto total = [](const float(&values)[kLanes]) { return std::accumulate(values, values + kLanes, 0.0f); };
    for (int p = 0, k = 0; p < 5; ++p) {
      sums.b(p) += total(b[p]);
      for (int q = p; q < 5; ++q, ++k) sums.a(p, q) += total(a[k]);
    }
    error += total(errors);
    sums.weight += total(weights);
    seen += total(counts);
  }
  sums.a.triangularView<Eigen::StrictlyLower>() = sums.a.transpose();
  if (seen > 0) sums.mean_error = error / seen;
  sums.overlap = seen / ((width - 2 * kBorder) * (height - 2 * kBorder));
  return sums;
}

double scaleOf(const Sums& sums) {
  return std::clamp(kSigmaOfMeanAbsolute * sums.mean_error, kSmallestScale_grey, kLargestScale_grey);
}

// Gauss-Newton until the mean error no longer falls; what made it rise is undone.
Fit descend(const Pair& pair, const Estimate& start, double scale, const RotationOptions& options) {
  Fit best{start, evaluate(pair, start, scale)};
  const double prior = options.gain_prior_grey * options.gain_prior_grey;
  for (int i = 0; i < options.iterations && best.sums.overlap >= options.overlap; ++i) {
    Matrix5d a = best.sums.a;
    Vector5d b = best.sums.b;
    a(3, 3) += prior * best.sums.weight;
    b(3) += prior * best.sums.weight * (best.estimate.gain - 1);
    // A trace of damping keeps a picture without structure solvable; its step is then nothing.
    const double damping = 1e-6 * a.topLeftCorner<3, 3>().trace() + 1e-9;
    a.diagonal().head<3>().array() += damping;
    const Vector5d step = a.ldlt().solve(-b);
    if (!step.allFinite()) break;
    const Eigen::Vector3d phi = step.head<3>();
    const double angle = phi.norm();
    Fit next;
    next.estimate.gain = std::clamp(best.estimate.gain + step(3), 1 / kLargestGain, kLargestGain);
    next.estimate.bias = best.estimate.bias + step(4);
    next.estimate.R_current_previous = best.estimate.R_current_previous;
    if (angle > 0)
      next.estimate.R_current_previous.applyOnTheLeft(Eigen::AngleAxisd(angle, phi / angle).toRotationMatrix());
    next.sums = evaluate(pair, next.estimate, scaleOf(best.sums));
    if (next.sums.overlap < options.overlap || next.sums.mean_error >= best.sums.mean_error) break;
    best = next;
    if (angle * pair.camera.fx < options.stop_px) break;
  }
  return best;
}

// The shift by whole pixels that leaves the least difference, as a turn: a start for turns beyond the reach of descent.
Estimate bestShift(const Pair& pair, const Estimate& guess) {
  const int width = pair.previous.width(), height = pair.previous.height();
  const float bias = static_cast<float>(guess.bias);
  double best = 1e9;
  int best_x = 0, best_y = 0;
  for (int dy = -height / kShift; dy <= height / kShift; ++dy)
    for (int dx = -width / kShift; dx <= width / kShift; ++dx) {
      float sum = 0;
      const int x0 = std::max(0, -dx), x1 = std::min(width, width - dx);
      const int y0 = std::max(0, -dy), y1 = std::min(height, height - dy);
      for (int y = y0; y < y1; ++y) {
        const float* a = pair.previous.row(y);
        const float* b = pair.current.row(y + dy) + dx;
        for (int x = x0; x < x1; ++x) sum += std::min(kMost_grey, std::abs(b[x] - a[x] - bias));
      }
      const double error = static_cast<double>(sum) / ((x1 - x0) * (y1 - y0));
      if (error >= best) continue;
      best = error;
      best_x = dx;
      best_y = dy;
    }
  Estimate shifted = guess;
  shifted.R_current_previous = (Eigen::AngleAxisd(std::atan(best_x / pair.camera.fx), Eigen::Vector3d::UnitY()) *
                                Eigen::AngleAxisd(-std::atan(best_y / pair.camera.fy), Eigen::Vector3d::UnitX()))
                                   .toRotationMatrix();
  return shifted;
}

double weakestGreyPerDegree(const Sums& sums) {
  if (!(sums.weight > 0)) return 0;
  const Eigen::Matrix3d a = sums.a.topLeftCorner<3, 3>() / sums.weight;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(a, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, eigen.eigenvalues()(0))) * M_PI / 180;
}

// Halves both pictures into the workspace; returns how many levels there are below the given one.
size_t fillHalved(const CameraModel& camera, const Image<float>& previous, const Image<float>& current,
                  int narrowest_px, RotationWorkspace& workspace) {
  size_t count = 0;
  const Image<float>* from_previous = &previous;
  const Image<float>* from_current = &current;
  CameraModel from_camera = camera;
  workspace.halved.reserve(16);  // pointers into it live while it grows
  while (from_camera.width / 2 >= narrowest_px && from_camera.height / 2 >= kShortestSide_px && count < 16) {
    if (workspace.halved.size() == count) workspace.halved.emplace_back();
    RotationWorkspace::Level& level = workspace.halved[count++];
    level.camera = from_camera.shrunk(2);
    halve(*from_previous, level.previous);
    halve(*from_current, level.current);
    from_previous = &level.previous;
    from_current = &level.current;
    from_camera = level.camera;
  }
  return count;
}

}  // namespace

RotationAlignment alignRotation(const CameraModel& camera, const Image<float>& previous, const Image<float>& current,
                                const Eigen::Matrix3d& R_guess, const RotationOptions& options,
                                RotationWorkspace& workspace) {
  RotationAlignment result;
  result.R_previous_current = R_guess;
  const auto fits = [&](const Image<float>& image) {
    return image.width() == camera.width && image.height() == camera.height;
  };
  if (!fits(previous) || !fits(current) || camera.width < kShortestSide_px || camera.height < kShortestSide_px)
    return result;

  const size_t halved = fillHalved(camera, previous, current, options.narrowest_px, workspace);
  const auto pairAt = [&](size_t level) {
    if (level == 0) return Pair{camera, previous, current};
    const RotationWorkspace::Level& l = workspace.halved[level - 1];
    return Pair{l.camera, l.previous, l.current};
  };
  Estimate guess;
  guess.R_current_previous = R_guess.transpose();
  guess.bias = mean(current) - mean(previous);
  result.start_error = evaluate(pairAt(0), guess, kLargestScale_grey).mean_error;
  Estimate still = guess;
  still.R_current_previous.setIdentity();

  const Pair coarsest = pairAt(halved);
  Fit fit = descend(coarsest, guess, kLargestScale_grey, options);
  for (const Estimate& start : {still, bestShift(coarsest, guess)}) {
    const Fit other = descend(coarsest, start, kLargestScale_grey, options);
    if (other.sums.mean_error < fit.sums.mean_error) fit = other;
  }
  for (size_t level = halved; level-- > 0;) fit = descend(pairAt(level), fit.estimate, scaleOf(fit.sums), options);
  // What the coarser levels take for a small turn may be none: the guess is not given up for a worse fit.
  if (fit.sums.mean_error > result.start_error) fit = descend(pairAt(0), guess, scaleOf(fit.sums), options);

  result.mean_error = fit.sums.mean_error;
  result.overlap = fit.sums.overlap;
  result.weakest_grey_per_degree = weakestGreyPerDegree(fit.sums);
  result.usable = fit.sums.overlap >= options.overlap && fit.sums.mean_error <= result.start_error &&
                  fit.sums.mean_error <= options.explained * meanDeviation(previous) &&
                  result.weakest_grey_per_degree >= options.weakest_grey_per_degree;
  if (result.usable)
    result.R_previous_current =
        Eigen::Quaterniond(fit.estimate.R_current_previous.transpose()).normalized().toRotationMatrix();
  return result;
}

}  // namespace comap
