#include "protocol/types/tile_quantisation.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace comap {
namespace {

constexpr double kSteps = 65536;  // of position, a tile edge
constexpr float kMinRadius_m = 0.0005f;
constexpr float kLogRadiusStep = 0.0295588022f;  // ln 1.03
constexpr uint8_t kRim = 254;
constexpr float kNormalSteps = 127;  // from the middle to either side: the axes are exact

uint16_t quantisePosition(float position, int32_t tile) {
  const double inside = double{position} / double{kTileEdge_m} - tile;
  return static_cast<uint16_t>(std::clamp(std::floor(inside * kSteps), 0.0, kSteps - 1));
}

float dequantisePosition(uint16_t value, int32_t tile) {
  return static_cast<float>((tile + (value + 0.5) / kSteps) * double{kTileEdge_m});
}

float signOf(float v) { return v < 0 ? -1.0f : 1.0f; }

uint8_t quantiseUnit(float v) {
  return static_cast<uint8_t>(std::lround(std::clamp(v, -1.0f, 1.0f) * kNormalSteps) + std::lround(kNormalSteps));
}

// The sphere onto an octahedron, its lower half folded out over the corners of the square.
void quantiseNormal(const Eigen::Vector3f& n, TileSurfel& out) {
  const float sum = n.cwiseAbs().sum();
  float u = 0, v = 0;
  if (sum > 0) {
    u = n.x() / sum;
    v = n.y() / sum;
    if (n.z() < 0) {
      const float folded = (1 - std::abs(v)) * signOf(u);
      v = (1 - std::abs(u)) * signOf(v);
      u = folded;
    }
  }
  out.normal_u = quantiseUnit(u);
  out.normal_v = quantiseUnit(v);
  // The rim of the square folds onto itself: of two codes of one direction, take one.
  if (out.normal_u == 0 || out.normal_u == kRim) out.normal_v = std::min<uint8_t>(out.normal_v, kRim - out.normal_v);
  if (out.normal_v == 0 || out.normal_v == kRim) out.normal_u = std::min<uint8_t>(out.normal_u, kRim - out.normal_u);
}

Eigen::Vector3f dequantiseNormal(uint8_t qu, uint8_t qv) {
  const float u = std::min((static_cast<float>(qu) - kNormalSteps) / kNormalSteps, 1.0f);
  const float v = std::min((static_cast<float>(qv) - kNormalSteps) / kNormalSteps, 1.0f);
  Eigen::Vector3f n(u, v, 1 - std::abs(u) - std::abs(v));
  if (n.z() < 0) {
    n.x() = (1 - std::abs(v)) * signOf(u);
    n.y() = (1 - std::abs(u)) * signOf(v);
  }
  return n.normalized();
}

uint8_t quantiseRadius(float radius_m) {
  if (radius_m <= kMinRadius_m) return 0;
  return static_cast<uint8_t>(std::min(std::lround(std::log(radius_m / kMinRadius_m) / kLogRadiusStep), 255L));
}

const std::array<float, 256>& radii() {
  static const std::array<float, 256> kRadii = [] {
    std::array<float, 256> table{};
    for (size_t i = 0; i < table.size(); ++i) {
      table[i] = kMinRadius_m * static_cast<float>(std::pow(1.03, static_cast<double>(i)));
    }
    return table;
  }();
  return kRadii;
}

}  // namespace

void quantiseDisc(const TileDisc& disc, const TileKey& key, TileSurfel& to) {
  to.x = quantisePosition(disc.position.x(), key.x);
  to.y = quantisePosition(disc.position.y(), key.y);
  to.z = quantisePosition(disc.position.z(), key.z);
  quantiseNormal(disc.normal, to);
  to.log_radius = quantiseRadius(disc.radius_m);
}

TileDisc dequantiseDisc(const TileSurfel& surfel, const TileKey& key) {
  return {
      {dequantisePosition(surfel.x, key.x), dequantisePosition(surfel.y, key.y), dequantisePosition(surfel.z, key.z)},
      dequantiseNormal(surfel.normal_u, surfel.normal_v),
      radii()[surfel.log_radius]};
}

}  // namespace comap
