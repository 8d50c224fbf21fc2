#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "fleet_tools/render/surfel_renderer.h"

namespace comap {
namespace {

constexpr size_t kSamples = 20000;
constexpr double kMargin = 0.46;      // of the picture's size, from its middle to the outermost point
constexpr double kOutliers = 0.0002;  // share of points that may fall outside

Eigen::Matrix3d lookAlong(const Eigen::Vector3d& forward, const Eigen::Vector3d& up) {
  const Eigen::Vector3d z = forward.normalized();
  Eigen::Vector3d x = z.cross(up);
  if (x.norm() < 1e-6) x = z.unitOrthogonal();
  x.normalize();
  Eigen::Matrix3d rotation;
  rotation << x, z.cross(x), z;
  return rotation;
}

std::vector<Eigen::Vector3d> samplePoints(std::span<const Surfel> surfels) {
  std::vector<Eigen::Vector3d> points;
  const size_t step = std::max<size_t>(1, surfels.size() / kSamples);
  for (size_t i = 0; i < surfels.size(); i += step) points.push_back(surfels[i].position.cast<double>());
  return points;
}

// Low and high end of the values without outliers.
std::pair<double, double> rangeOf(std::vector<double> values) {
  const auto at = [&](double share) {
    const auto nth = values.begin() + static_cast<ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), nth, values.end());
    return *nth;
  };
  return {at(kOutliers), at(1 - kOutliers)};
}

// The camera of the given orientation from which all points just fit into the picture.
PictureView fit(const std::vector<Eigen::Vector3d>& points, const Eigen::Matrix3d& rotation, double focal, int width,
                int height) {
  PictureView view;
  view.camera = {focal, focal, (width - 1) / 2.0, (height - 1) / 2.0, width, height};
  view.both_sides = false;
  // In the camera's axes each edge of the picture is a plane; the points push it out.
  std::vector<double> left, right, upper, lower, depth;
  const double slope_x = kMargin * width / focal, slope_y = kMargin * height / focal;
  for (const auto& point : points) {
    const Eigen::Vector3d p = rotation.transpose() * point;
    left.push_back(p.x() - slope_x * -p.z());
    right.push_back(p.x() - slope_x * p.z());
    upper.push_back(p.y() - slope_y * -p.z());
    lower.push_back(p.y() - slope_y * p.z());
    depth.push_back(p.z());
  }
  const double l = rangeOf(left).first, r = rangeOf(right).second;
  const double u = rangeOf(upper).first, b = rangeOf(lower).second;
  // x + s (z - z0) >= x0 for the leftmost and x - s (z - z0) <= x0 for the rightmost give x0 and z0.
  const double z_for_x = (l - r) / (2 * slope_x), z_for_y = (u - b) / (2 * slope_y);
  const double nearest = rangeOf(depth).first - 0.3;
  const Eigen::Vector3d eye((l + r) / 2, (u + b) / 2, std::min({z_for_x, z_for_y, nearest}));
  view.T_map_cam = Pose(rotation, rotation * eye);
  return view;
}

// Area of the surfels that face a camera looking along `forward`.
double areaShown(std::span<const Surfel> surfels, const Eigen::Vector3f& forward) {
  double area = 0;
  const size_t step = std::max<size_t>(1, surfels.size() / kSamples);
  for (size_t i = 0; i < surfels.size(); i += step) {
    const float facing = -surfels[i].normal.dot(forward);
    if (facing > 0.1f) area += facing * surfels[i].radius * surfels[i].radius;
  }
  return area;
}

}  // namespace

Eigen::Vector3d upDirection(std::span<const Surfel> surfels, std::span<const Pose> T_map_cams) {
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  for (const Pose& pose : T_map_cams) up -= pose.rotationMatrix().col(1);
  if (up.norm() < 1e-6) up = -Eigen::Vector3d::UnitY();
  up.normalize();
  for (const double degrees : {40.0, 20.0, 10.0}) {
    const auto limit = static_cast<float>(std::cos(degrees * std::numbers::pi / 180));
    const Eigen::Vector3f guess = up.cast<float>();
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const Surfel& s : surfels) {
      if (s.normal.dot(guess) > limit) sum += (s.radius * s.radius * s.normal).cast<double>();
    }
    if (sum.norm() > 1e-9) up = sum.normalized();
  }
  return up;
}

PictureView orbitView(std::span<const Surfel> surfels, const Eigen::Vector3d& up, int width, int height) {
  const Eigen::Vector3d east = up.unitOrthogonal(), north = up.cross(east);
  const double elevation = 45 * std::numbers::pi / 180;
  Eigen::Vector3d best = -up;
  double best_area = -1;
  for (int i = 0; i < 24; ++i) {
    const double azimuth = i * std::numbers::pi / 12;
    const Eigen::Vector3d level = std::cos(azimuth) * east + std::sin(azimuth) * north;
    const Eigen::Vector3d forward = std::cos(elevation) * level - std::sin(elevation) * up;
    const double area = areaShown(surfels, forward.cast<float>());
    if (area > best_area) {
      best_area = area;
      best = forward;
    }
  }
  return fit(samplePoints(surfels), lookAlong(best, up), 1.4 * width, width, height);
}

PictureView topView(std::span<const Surfel> surfels, const Eigen::Vector3d& up, int width, int height) {
  // The longer side of the map along the longer side of the picture.
  const auto points = samplePoints(surfels);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& p : points) mean += p / static_cast<double>(points.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const auto& p : points) {
    const Eigen::Vector3d level = p - mean - up * up.dot(p - mean);
    spread += level * level.transpose();
  }
  const Eigen::Vector3d longest = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(2);
  const Eigen::Vector3d screen_up = width >= height ? up.cross(longest) : longest;
  return fit(points, lookAlong(-up, screen_up), 4.0 * width, width, height);
}

PictureView cameraView(const Pose& T_map_cam, int width, int height) {
  PictureView view;
  const double focal = 0.82 * width;
  view.camera = {focal, focal, (width - 1) / 2.0, (height - 1) / 2.0, width, height};
  view.T_map_cam = T_map_cam;
  return view;
}

}  // namespace comap
