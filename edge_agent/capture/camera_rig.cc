#include "edge_agent/capture/camera_rig.h"

#include <cmath>

namespace comap {
namespace {

constexpr int kMostSteps = 50;
constexpr double kExact = 1e-10;

Eigen::Vector2d distorted(const Lens& lens, double x, double y) {
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (lens.k1 + r2 * (lens.k2 + r2 * lens.k3));
  return {x * radial + 2 * lens.p1 * x * y + lens.p2 * (r2 + 2 * x * x),
          y * radial + lens.p1 * (r2 + 2 * y * y) + 2 * lens.p2 * x * y};
}

CameraModel vga(double f) { return {f, f, 319.5, 239.5, 640, 480}; }

CameraProfile profile(const std::string& name, double colour_f, double depth_f, double depth_x_m, float floor_m,
                      float factor_per_m) {
  CameraProfile made;
  made.name = name;
  made.rig.colour.pinhole = vga(colour_f);
  made.rig.depth.pinhole = vga(depth_f);
  made.rig.T_colour_depth = Pose(Eigen::Quaterniond::Identity(), {depth_x_m, 0, 0});
  made.noise_floor_m = floor_m;
  made.noise_factor_per_m = factor_per_m;
  return made;
}

}  // namespace

Eigen::Vector2d Lens::pixelOf(double x, double y) const {
  const Eigen::Vector2d bent = distorted(*this, x, y);
  return {pinhole.fx * bent.x() + pinhole.cx, pinhole.fy * bent.y() + pinhole.cy};
}

std::optional<Eigen::Vector2d> Lens::rayOf(double u, double v) const {
  const Eigen::Vector2d bent((u - pinhole.cx) / pinhole.fx, (v - pinhole.cy) / pinhole.fy);
  if (straight()) return bent;
  // Newton with the analytic slope; from the bent ray itself it is a few steps.
  Eigen::Vector2d ray = bent;
  for (int step = 0; step < kMostSteps; ++step) {
    const double x = ray.x(), y = ray.y(), r2 = x * x + y * y;
    const Eigen::Vector2d error = distorted(*this, x, y) - bent;
    const double radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
    const double slope = 2 * (k1 + r2 * (2 * k2 + r2 * 3 * k3));  // of radial, by x it is slope * x
    Eigen::Matrix2d J;
    J << radial + slope * x * x + 2 * p1 * y + 6 * p2 * x, slope * x * y + 2 * p1 * x + 2 * p2 * y,
        slope * x * y + 2 * p1 * x + 2 * p2 * y, radial + slope * y * y + 6 * p1 * y + 2 * p2 * x;
    // Beyond the turning point of the polynomial two rays share a pixel, and none of them is right.
    if (!(J.determinant() > 1e-6) || radial <= 0) return std::nullopt;
    if (error.norm() < kExact) return ray;
    ray -= J.inverse() * error;
    if (!ray.allFinite()) return std::nullopt;
  }
  return std::nullopt;
}

const std::vector<CameraProfile>& cameraProfiles() {
  static const std::vector<CameraProfile> profiles{
      // Microsoft Kinect of the Xbox 360.
      profile("kinect-v1", 525, 585, -0.025, 0.001f, 0.0019f),
      // Asus Xtion Pro Live, PrimeSense Carmine.
      profile("xtion", 535, 570, -0.025, 0.001f, 0.0019f),
      // Intel RealSense D435, D435i, D455 at 640x480: 0.08 pixels of disparity over f times baseline (50 mm).
      profile("realsense-d435", 610, 385, 0.015, 0.001f, 0.0042f),
      // Intel RealSense D415 at 640x480.
      profile("realsense-d415", 615, 600, 0.015, 0.001f, 0.0024f),
      // Orbbec Astra, Astra Pro.
      profile("orbbec-astra", 525, 570, -0.025, 0.001f, 0.0019f),
  };
  return profiles;
}

std::optional<Lens> resized(const Lens& lens, int width, int height) {
  const CameraModel& from = lens.pinhole;
  if (from.width <= 0 || int64_t{width} * from.height != int64_t{height} * from.width) return std::nullopt;
  const double scale = static_cast<double>(width) / from.width;
  Lens made = lens;
  made.pinhole = {from.fx * scale, from.fy * scale, (from.cx + 0.5) * scale - 0.5, (from.cy + 0.5) * scale - 0.5,
                  width,           height};
  return made;
}

}  // namespace comap
