#include "fleet_tools/render/surfel_renderer.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace comap {
namespace {

constexpr size_t kMostPixels = 1u << 23;  // of one prediction
constexpr float kEnlarged = 1.25f;        // discs, to close the last pinholes

Eigen::Vector3f toVector(Rgb c) { return {static_cast<float>(c.r), static_cast<float>(c.g), static_cast<float>(c.b)}; }

Rgb toRgb(const Eigen::Vector3f& v) {
  const auto channel = [](float x) { return static_cast<uint8_t>(std::clamp(std::lround(x), 0l, 255l)); };
  return {channel(v.x()), channel(v.y()), channel(v.z())};
}

Eigen::Vector3f contributionColour(uint32_t contributors) {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  for (uint32_t bits = contributors; bits; bits &= bits - 1) sum += toVector(robotColour(std::countr_zero(bits)));
  return contributors ? Eigen::Vector3f(sum / static_cast<float>(std::popcount(contributors)))
                      : Eigen::Vector3f(160, 160, 160);
}

// Dark blue over green to yellow, on a logarithmic scale from 1 to 50.
Eigen::Vector3f confidenceColour(float confidence) {
  static const std::array<Eigen::Vector3f, 5> stops = {Eigen::Vector3f(68, 1, 84), Eigen::Vector3f(59, 82, 139),
                                                       Eigen::Vector3f(33, 145, 140), Eigen::Vector3f(94, 201, 98),
                                                       Eigen::Vector3f(253, 231, 37)};
  const float place = std::clamp(std::log(std::max(confidence, 1.0f)) / std::log(50.0f), 0.0f, 1.0f) * 4;
  const auto below = std::min(static_cast<size_t>(place), size_t{3});
  const float part = place - static_cast<float>(below);
  return (1 - part) * stops[below] + part * stops[below + 1];
}

// Each axis of the map's frame a channel: grey is none of it.
Eigen::Vector3f normalColour(const Eigen::Vector3f& normal_map) {
  return (normal_map + Eigen::Vector3f::Ones()) * 127.5f;
}

Eigen::Vector3f groundColour(int y, int height) {
  const float part = static_cast<float>(y) / static_cast<float>(height);
  return (1 - part) * Eigen::Vector3f(236, 240, 246) + part * Eigen::Vector3f(203, 210, 221);
}

// A light over the viewer's left shoulder; enough to tell surfaces of one colour apart.
float shade(const Eigen::Vector3f& normal_cam) {
  const Eigen::Vector3f to_light = Eigen::Vector3f(-0.4f, -0.6f, -0.7f).normalized();
  return 0.78f + 0.27f * std::max(0.0f, normal_cam.dot(to_light));
}

Eigen::Vector3f paint(const PredictedView& seen, size_t pixel, const Eigen::Matrix3f& R_map_cam, Colouring colouring) {
  const Eigen::Vector3f normal = seen.normal.data()[pixel];
  const Eigen::Vector3f colour = toVector(seen.colour.data()[pixel]);
  switch (colouring) {
    case Colouring::kNormal:
      return normalColour(R_map_cam * normal);
    case Colouring::kContribution: {
      const float grey = colour.dot(Eigen::Vector3f(0.299f, 0.587f, 0.114f)) / 255;
      return contributionColour(seen.contributors.data()[pixel]) * (0.65f + 0.45f * grey) * shade(normal);
    }
    case Colouring::kConfidence:
      return confidenceColour(seen.confidence.data()[pixel]) * shade(normal);
    default:
      return colour * shade(normal);
  }
}

}  // namespace

std::vector<LegendEntry> legendOf(Colouring colouring, std::span<const std::string> robots) {
  std::vector<LegendEntry> legend;
  switch (colouring) {
    case Colouring::kContribution:
      return robotLegend(robots);
    case Colouring::kNormal:
      for (const char* axis : {"x", "-x", "y", "-y", "z", "-z"}) {
        const bool negative = axis[0] == '-';
        const Eigen::Vector3f normal = (negative ? -1.0f : 1.0f) * Eigen::Vector3f::Unit(axis[negative] - 'x');
        legend.push_back({toRgb(normalColour(normal)), axis});
      }
      return legend;
    case Colouring::kConfidence:
      for (const int weight : {1, 3, 7, 19, 50})
        legend.push_back({toRgb(confidenceColour(static_cast<float>(weight))), std::to_string(weight)});
      return legend;
    default:
      return legend;
  }
}

Result<ColourImage> renderPicture(gpu::Device& device, std::span<const Surfel> surfels, const PictureView& view,
                                  Colouring colouring, std::span<const LegendEntry> legend) {
  std::vector<Surfel> enlarged(surfels.begin(), surfels.end());
  for (Surfel& s : enlarged) s.radius *= kEnlarged;
  auto map = SurfelMap::create(device, FusionParameters{});
  if (!map) return map.error();
  if (auto done = map->append(enlarged); !done) return done.error();

  // Several samples a pixel smooth the discs' rims, as far as the device's buffers allow.
  const int width = view.camera.width, height = view.camera.height;
  const size_t pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
  const int factor = 4 * pixels <= kMostPixels ? 2 : 1;
  CameraModel camera = view.camera;
  camera.fx *= factor;
  camera.fy *= factor;
  camera.cx = (camera.cx + 0.5) * factor - 0.5;
  camera.cy = (camera.cy + 0.5) * factor - 0.5;
  camera.width *= factor;
  camera.height *= factor;
  auto seen = map->predict(camera, view.T_map_cam, {0, 1000, view.both_sides, true});
  if (!seen) return seen.error();
  const float* depth_m = seen->depth_m.data();
  const size_t samples = pixels * static_cast<size_t>(factor * factor);
  if (std::none_of(depth_m, depth_m + samples, [](float depth) { return depth > 0; }))
    return Error{ErrorCode::kProblem, "no surfel is in view"};

  const Eigen::Matrix3f R_map_cam = view.T_map_cam.rotationMatrix().cast<float>();
  ColourImage picture(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      Eigen::Vector3f sum = Eigen::Vector3f::Zero();
      for (int sample = 0; sample < factor * factor; ++sample) {
        const size_t row = static_cast<size_t>(y) * factor + sample / factor;
        const size_t pixel =
            row * static_cast<size_t>(camera.width) + static_cast<size_t>(x) * factor + sample % factor;
        sum += seen->depth_m.data()[pixel] > 0 ? paint(*seen, pixel, R_map_cam, colouring) : groundColour(y, height);
      }
      picture.at(x, y) = toRgb(sum / static_cast<float>(factor * factor));
    }
  }
  drawLegend(picture, legend);
  return picture;
}

}  // namespace comap
