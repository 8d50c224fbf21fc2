#include "mapping_core/rgbd/rotation_alignment.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace comap {
namespace {

using Vector5d = Eigen::Matrix<double, 5, 1>;
using Matrix5d = Eigen::Matrix<double, 5, 5>;

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

// Normal equations at one estimate; residuals beyond Huber's limit of `scale` pull with constant force.
Sums evaluate(const Pair& pair, const Estimate& estimate, double scale) {
  const int width = pair.previous.width(), height = pair.previous.height();
  const float fx = static_cast<float>(pair.camera.fx), fy = static_cast<float>(pair.camera.fy);
  const float cx = static_cast<float>(pair.camera.cx), cy = static_cast<float>(pair.camera.cy);
  const float u_max = static_cast<float>(width) - 2.001f, v_max = static_cast<float>(height) - 2.001f;
  const float gain = static_cast<float>(estimate.gain), bias = static_cast<float>(estimate.bias);
  const float limit = kHuber * static_cast<float>(scale);
  const Eigen::Matrix3f r = estimate.R_current_previous.cast<float>();
  Sums sums;
  double error = 0;
  size_t seen = 0;
  for (int y = kBorder; y < height - kBorder; ++y) {
    const float* row = pair.previous.row(y);
    float a[15] = {}, b[5] = {}, row_error = 0, row_weight = 0;  // of one row: floats stay exact enough
    for (int x = kBorder; x < width - kBorder; ++x) {
      const Eigen::Vector3f ray((static_cast<float>(x) - cx) / fx, (static_cast<float>(y) - cy) / fy, 1);
      const Eigen::Vector3f q = r * ray;
      if (q.z() < 0.1f) continue;
      const float iz = 1 / q.z(), u = fx * q.x() * iz + cx, v = fy * q.y() * iz + cy;
      if (!(u >= 1 && v >= 1 && u <= u_max && v <= v_max)) continue;
      const int u0 = static_cast<int>(u), v0 = static_cast<int>(v);
      const float s = u - static_cast<float>(u0), t = v - static_cast<float>(v0);
      const float* g = pair.current.row(v0) + u0;
      const float i00 = g[0], i10 = g[1], i01 = g[width], i11 = g[width + 1];
      const float value = (1 - t) * ((1 - s) * i00 + s * i10) + t * ((1 - s) * i01 + s * i11);
      // Mean of both pictures' gradients: its error is of second order in the turn that is still missing.
      const Eigen::Vector2f gradient(
          0.5f * ((1 - t) * (i10 - i00) + t * (i11 - i01) + gain * 0.5f * (row[x + 1] - row[x - 1])),
          0.5f * ((1 - s) * (i01 - i00) + s * (i11 - i10) + gain * 0.5f * (row[x + width] - row[x - width])));
      const float residual = value - (gain * row[x] + bias), size = std::abs(residual);
      const float weight = size <= limit ? 1.0f : limit / size;
      const Eigen::Matrix<float, 1, 3> turn = rotationJacobian<float>(ray, r, gradient, fx, fy);
      const float j[5] = {turn(0), turn(1), turn(2), -row[x], -1};
      for (int p = 0, k = 0; p < 5; ++p) {
        const float wj = weight * j[p];
        b[p] += wj * residual;
        for (int c = p; c < 5; ++c, ++k) a[k] += wj * j[c];
      }
      row_error += std::min(kMost_grey, size);
      row_weight += weight;
      ++seen;
    }
    for (int p = 0, k = 0; p < 5; ++p) {
      sums.b(p) += b[p];
      for (int c = p; c < 5; ++c, ++k) sums.a(p, c) += a[k];
    }
    error += row_error;
    sums.weight += row_weight;
  }
  sums.a.triangularView<Eigen::StrictlyLower>() = sums.a.transpose();
  if (seen > 0) sums.mean_error = error / static_cast<double>(seen);
  sums.overlap = static_cast<double>(seen) / static_cast<double>((width - 2 * kBorder) * (height - 2 * kBorder));
  return sums;
}

double scaleOf(const Sums& sums) {
  return std::clamp(kSigmaOfMeanAbsolute * sums.mean_error, kSmallestScale_grey, kLargestScale_grey);
}

// Gauss-Newton until the mean error no longer falls; what made it rise is undone.
Fit descend(const Pair& pair, const Estimate& start, const RotationOptions& options) {
  Fit best{start, evaluate(pair, start, kLargestScale_grey)};
  best.sums = evaluate(pair, start, scaleOf(best.sums));
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
    if (angle > 0) next.estimate.R_current_previous *= Eigen::AngleAxisd(angle, phi / angle).toRotationMatrix();
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
  Fit fit = descend(coarsest, guess, options);
  for (const Estimate& start : {still, bestShift(coarsest, guess)}) {
    const Fit other = descend(coarsest, start, options);
    if (other.sums.mean_error < fit.sums.mean_error) fit = other;
  }
  for (size_t level = halved; level-- > 0;) fit = descend(pairAt(level), fit.estimate, options);
  // What the coarser levels take for a small turn may be none: the guess is not given up for a worse fit.
  if (fit.sums.mean_error > result.start_error) fit = descend(pairAt(0), guess, options);

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
