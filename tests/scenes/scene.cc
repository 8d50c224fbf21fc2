#include "tests/scenes/scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace comap {
namespace {

constexpr int kWaves = 14;
constexpr double kBlur_px = 3;  // that a lens and a colour filter leave of a sharp edge
constexpr double kShortestWave_m = 0.06, kLongestWave_m = 2.5;
constexpr float kSolidGrey = 45;
// Amplitudes: as in real rooms most of the power is in large shapes, and there is grain enough to align by.
constexpr double kShortestGrey = 4, kLongestGrey = 24;

uint8_t toByte(float grey) { return static_cast<uint8_t>(std::clamp(std::lround(grey), 0l, 255l)); }

}  // namespace

Scene Scene::room(uint64_t seed) {
  Scene scene;
  scene.solids_ = {
      {Shape::kRoom, {0, 0, 0}, {2.5, 1.4, 2.5}},        {Shape::kBox, {-1.1, 0.95, 1.5}, {0.5, 0.45, 0.35}},
      {Shape::kBox, {1.2, 0.6, 1.9}, {0.3, 0.8, 0.4}},   {Shape::kBox, {0.1, -0.7, 2.3}, {0.6, 0.3, 0.2}},
      {Shape::kBox, {-1.8, 0.7, -1.6}, {0.5, 0.7, 0.5}}, {Shape::kBox, {1.9, 0.4, -0.9}, {0.4, 1.0, 0.3}},
      {Shape::kSphere, {0.35, 1.0, 1.6}, {0.4, 0, 0}},   {Shape::kSphere, {-1.9, -0.2, 0.4}, {0.35, 0, 0}},
      {Shape::kSphere, {0.4, 0.9, -2.0}, {0.5, 0, 0}}};
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::normal_distribution<double> normal;
  for (int i = 0; i < kWaves; ++i) {
    const double share = (i + unit(random)) / kWaves;
    const double wavelength = kShortestWave_m * std::pow(kLongestWave_m / kShortestWave_m, share);
    const Eigen::Vector3d direction = Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
    Wave wave;
    wave.k = (direction * (2 * M_PI / wavelength)).cast<float>();
    const double amplitude = kShortestGrey * std::pow(kLongestGrey / kShortestGrey, share);
    for (int c = 0; c < 3; ++c) wave.grey(c) = static_cast<float>(amplitude * (0.5 + unit(random)));
    wave.phase = static_cast<float>(2 * M_PI * unit(random));
    scene.waves_.push_back(wave);
  }
  for (Solid& solid : scene.solids_)
    if (solid.shape != Shape::kRoom)
      for (int c = 0; c < 3; ++c) solid.grey(c) += kSolidGrey * static_cast<float>(2 * unit(random) - 1);
  return scene;
}

Scene Scene::plainPlane(const Eigen::Vector3d& point, const Eigen::Vector3d& normal, uint8_t grey) {
  Scene scene;
  scene.solids_ = {{Shape::kPlane, point, normal, Eigen::Vector3f::Constant(grey)}};
  return scene;
}

Scene Scene::corridor() {
  Scene scene;
  const auto grey = [](float value) { return Eigen::Vector3f::Constant(value); };
  scene.colour_samples_ = 3;  // a camera does not see steps along the edges
  scene.solids_ = {{Shape::kPlane, {0, 1.2, 0}, {0, -1, 0}, grey(70)},
                   {Shape::kPlane, {0, -1.3, 0}, {0, 1, 0}, grey(220)},
                   {Shape::kPlane, {-0.9, 0, 0}, {1, 0, 0}, grey(160)},
                   {Shape::kPlane, {1.1, 0, 0}, {-1, 0, 0}, grey(140)}};
  return scene;
}

Scene Scene::withBox(const Eigen::Vector3d& centre, const Eigen::Vector3d& half) const {
  Scene scene = *this;
  scene.solids_.push_back({Shape::kBox, centre, half});
  return scene;
}

double Scene::distanceTo(const Eigen::Vector3d& x_world) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Solid& solid : solids_) {
    const Eigen::Vector3d x = x_world - solid.centre;
    double distance = 0;
    switch (solid.shape) {
      case Shape::kPlane:
        distance = x.dot(solid.half) / solid.half.norm();
        break;
      case Shape::kSphere:
        distance = x.norm() - solid.half.x();
        break;
      case Shape::kRoom:
      case Shape::kBox: {
        const Eigen::Vector3d beyond = x.cwiseAbs() - solid.half;
        distance = beyond.cwiseMax(0.0).norm() + std::min(beyond.maxCoeff(), 0.0);
        break;
      }
    }
    nearest = std::min(nearest, std::abs(distance));
  }
  return nearest;
}

std::optional<double> Scene::intersect(const Solid& solid, const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) {
  const Eigen::Vector3d o = origin - solid.centre;
  std::optional<double> distance;
  switch (solid.shape) {
    case Shape::kPlane: {
      const double facing = ray.dot(solid.half);
      if (facing != 0) distance = -o.dot(solid.half) / facing;
      break;
    }
    case Shape::kSphere: {
      const double a = ray.squaredNorm(), b = o.dot(ray), c = o.squaredNorm() - solid.half.x() * solid.half.x();
      const double root = b * b - a * c;
      if (root > 0) distance = (-b - std::sqrt(root)) / a;
      break;
    }
    case Shape::kRoom:
    case Shape::kBox: {
      double in = -1e9, out = 1e9;
      for (int c = 0; c < 3; ++c) {
        if (ray(c) == 0) {
          if (std::abs(o(c)) > solid.half(c)) return std::nullopt;
          continue;
        }
        const double s0 = (-solid.half(c) - o(c)) / ray(c), s1 = (solid.half(c) - o(c)) / ray(c);
        in = std::max(in, std::min(s0, s1));
        out = std::min(out, std::max(s0, s1));
      }
      if (in < out) distance = solid.shape == Shape::kRoom ? out : in;
      break;
    }
  }
  if (!distance || *distance <= 0) return std::nullopt;
  return distance;
}

std::optional<Scene::Hit> Scene::cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& ray) const {
  std::optional<Hit> nearest;
  for (size_t i = 0; i < solids_.size(); ++i) {
    const auto distance = intersect(solids_[i], origin, ray);
    if (distance && (!nearest || *distance < nearest->distance)) nearest = Hit{*distance, i};
  }
  return nearest;
}

Rgb Scene::colourAt(const Eigen::Vector3d& x_world, size_t solid) const {
  // Each solid is cut from another place of the same texture, so that edges show in colour too.
  const Eigen::Vector3f x = x_world.cast<float>() + Eigen::Vector3f(1.7f, -2.3f, 3.1f) * static_cast<float>(solid);
  Eigen::Vector3f grey = solids_[solid].grey;
  for (const Wave& wave : waves_) grey += wave.grey * std::sin(wave.k.dot(x) + wave.phase);
  return {toByte(grey.x()), toByte(grey.y()), toByte(grey.z())};
}

Frame Scene::render(const CameraModel& camera, const Pose& T_world_cam, int64_t stamp_ns) const {
  Frame frame{stamp_ns, camera, ColourImage(camera.width, camera.height), DepthImage(camera.width, camera.height)};
  const Eigen::Matrix3d rotation = T_world_cam.rotationMatrix();
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector3d ray = rotation * camera.unproject(x, y, 1);
      const auto hit = cast(T_world_cam.translation(), ray);
      if (!hit) continue;
      frame.colour.at(x, y) = colour_samples_ == 1
                                  ? colourAt(T_world_cam.translation() + hit->distance * ray, hit->solid)
                                  : meanColour(camera, T_world_cam, x, y);
      // The ray has z = 1 in the camera, so its parameter is the depth.
      frame.depth.at(x, y) =
          static_cast<uint16_t>(std::clamp(std::lround(hit->distance * kDepthUnitsPerMetre), 0l, 65535l));
    }
  return frame;
}

Rgb Scene::meanColour(const CameraModel& camera, const Pose& T_world_cam, int x, int y) const {
  int r = 0, g = 0, b = 0, seen = 0;
  for (int j = 0; j < colour_samples_; ++j)
    for (int i = 0; i < colour_samples_; ++i) {
      const auto offset = [this](int k) { return kBlur_px * ((k + 0.5) / colour_samples_ - 0.5); };
      const Eigen::Vector3d ray = T_world_cam.rotationMatrix() * camera.unproject(x + offset(i), y + offset(j), 1);
      const auto hit = cast(T_world_cam.translation(), ray);
      if (!hit) continue;
      const Rgb colour = colourAt(T_world_cam.translation() + hit->distance * ray, hit->solid);
      r += colour.r;
      g += colour.g;
      b += colour.b;
      ++seen;
    }
  if (seen == 0) return {};
  const auto mean = [seen](int sum) { return static_cast<uint8_t>((sum + seen / 2) / seen); };
  return {mean(r), mean(g), mean(b)};
}

std::optional<double> Scene::depthAt(const CameraModel& camera, const Pose& T_world_cam, double u, double v) const {
  const auto hit = cast(T_world_cam.translation(), T_world_cam.rotationMatrix() * camera.unproject(u, v, 1));
  if (!hit) return std::nullopt;
  return hit->distance;
}

CameraModel kinectCamera() { return {525, 525, 319.5, 239.5, 640, 480}; }

CameraModel smallCamera() { return kinectCamera().shrunk(2); }

}  // namespace comap
