#include "mapping_core/verify/sketch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace comap {
namespace {

constexpr size_t kSketchLevel = 3;
constexpr float kComparableScale = 1.4f;

template <class Visit>
void forNeighbours(int width, int height, int x, int y, const Visit& visit) {
  for (int v = std::max(0, y - 1); v <= std::min(height - 1, y + 1); ++v)
    for (int u = std::max(0, x - 1); u <= std::min(width - 1, x + 1); ++u) visit(u, v);
}

ColourImage shrink(const ColourImage& colour, int width, int height) {
  constexpr int kBlock = 1 << kSketchLevel;
  ColourImage small(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      uint32_t r = 0, g = 0, b = 0;
      for (int v = 0; v < kBlock; ++v)
        for (int u = 0; u < kBlock; ++u) {
          const Rgb& pixel = colour.at(x * kBlock + u, y * kBlock + v);
          r += pixel.r;
          g += pixel.g;
          b += pixel.b;
        }
      constexpr uint32_t kPixels = kBlock * kBlock;
      small.at(x, y) = {static_cast<uint8_t>(r / kPixels), static_cast<uint8_t>(g / kPixels),
                        static_cast<uint8_t>(b / kPixels)};
    }
  return small;
}

using Levels = std::array<float, 3>;

Levels levelsOf(const Rgb& c) { return {static_cast<float>(c.r), static_cast<float>(c.g), static_cast<float>(c.b)}; }

struct Pair {
  int x, y;  // cell of the surfaces
  int u, v;  // and where it is seen
};

// Gain and bias of one channel, by least squares over those pairs that fit; near (1, 0) where nothing varies.
struct Exposure {
  float gain = 1, bias = 0;
};

Exposure fitExposure(const std::vector<Pair>& pairs, const Sketch& surfaces, const Sketch& seen, size_t channel) {
  constexpr int kRounds = 4;
  constexpr double kPriorVariance = 100;
  Exposure exposure;
  std::vector<float> wanted(pairs.size()), found(pairs.size()), residuals(pairs.size()), sorted;
  for (size_t i = 0; i < pairs.size(); ++i) {
    wanted[i] = levelsOf(surfaces.colour.at(pairs[i].x, pairs[i].y))[channel];
    found[i] = levelsOf(seen.colour.at(pairs[i].u, pairs[i].v))[channel];
  }
  for (int round = 0; round < kRounds; ++round) {
    for (size_t i = 0; i < pairs.size(); ++i)
      residuals[i] = std::abs(found[i] - (exposure.gain * wanted[i] + exposure.bias));
    float most = 0;
    if (round > 0) {
      sorted = residuals;
      const auto middle = sorted.begin() + static_cast<long>(sorted.size() / 2);
      std::nth_element(sorted.begin(), middle, sorted.end());
      most = std::max(6.0f, 3 * 1.4826f * *middle);
    }
    double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (size_t i = 0; i < pairs.size(); ++i) {
      if (round > 0 && residuals[i] > most) continue;
      const double x = wanted[i], y = found[i];
      n += 1;
      sx += x;
      sy += y;
      sxx += x * x;
      sxy += x * y;
    }
    const double mx = sx / n, my = sy / n;
    const double gain =
        std::clamp((sxy / n - mx * my + kPriorVariance) / (sxx / n - mx * mx + kPriorVariance), 0.5, 2.0);
    exposure = {static_cast<float>(gain), static_cast<float>(my - gain * mx)};
  }
  return exposure;
}

// Whether `wanted` lies outside of all that the cell and its neighbours show: a shift by a cell is no other colour.
bool discoloured(const ColourImage& colour, int u, int v, const Levels& wanted, float levels) {
  Levels low = {255, 255, 255}, high = {0, 0, 0};
  forNeighbours(colour.width(), colour.height(), u, v, [&](int x, int y) {
    const Levels c = levelsOf(colour.at(x, y));
    for (size_t i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], c[i]);
      high[i] = std::max(high[i], c[i]);
    }
  });
  for (size_t i = 0; i < 3; ++i)
    if (wanted[i] < low[i] - levels || wanted[i] > high[i] + levels) return true;
  return false;
}

// Cells set whose neighbours are set too, but for two: patches count, what flickers along edges does not.
size_t solidCells(const Image<uint8_t>& cells) {
  constexpr int kSolid = 7;  // of nine
  size_t solid = 0;
  for (int y = 1; y + 1 < cells.height(); ++y)
    for (int x = 1; x + 1 < cells.width(); ++x) {
      if (cells.at(x, y) == 0) continue;
      int sum = 0;
      forNeighbours(cells.width(), cells.height(), x, y, [&](int u, int v) { sum += cells.at(u, v); });
      solid += sum >= kSolid;
    }
  return solid;
}

}  // namespace

Sketch makeSketch(const Keyframe& keyframe, const Pyramid& pyramid, const DepthNoiseModel& noise) {
  const PyramidLevel& level = pyramid[kSketchLevel];
  const int width = level.depth_m.width(), height = level.depth_m.height();
  Sketch sketch;
  sketch.id = keyframe.id;
  sketch.camera = level.camera;
  sketch.depth_m = Image<float>(width, height);
  sketch.nearest_m = Image<float>(width, height);
  sketch.colour = shrink(keyframe.colour, width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const float own = level.depth_m.at(x, y);
      float near = 0, far = 0;
      forNeighbours(width, height, x, y, [&](int u, int v) {
        const float d = level.depth_m.at(u, v);
        if (d <= 0) return;
        near = near > 0 ? std::min(near, d) : d;
        far = std::max(far, d);
      });
      sketch.nearest_m.at(x, y) = near;
      // A plane seen at 80 degrees rises by 5.7 cells' width from one cell to the next, here over three.
      const float slope = 12 * own / static_cast<float>(level.camera.fx);
      const bool edge = far - near > 0.05f + slope + 3 * noise.sigma(own);
      if (own > 0 && !edge) sketch.depth_m.at(x, y) = own;
    }
  return sketch;
}

namespace {

// Where the cells of `surfaces` fall in `seen`: counts all but colours, and tells of each cell that agrees or is seen
// through.
template <class Through, class Agree>
Comparison placeCells(const Sketch& surfaces, const Sketch& seen, const Pose& T_surfaces_seen,
                      const ComparisonOptions& options, const Through& tellThrough, const Agree& tellAgreement) {
  const Pose T_seen_surfaces = T_surfaces_seen.inverse();
  const Eigen::Matrix3f r = T_seen_surfaces.rotationMatrix().cast<float>();
  const Eigen::Vector3f t = T_seen_surfaces.translation().cast<float>();
  const CameraModel& k = seen.camera;
  Comparison result;
  for (int y = 0; y < surfaces.depth_m.height(); ++y)
    for (int x = 0; x < surfaces.depth_m.width(); ++x) {
      const float z = surfaces.depth_m.at(x, y);
      if (z <= 0) continue;
      ++result.cells;
      const Eigen::Vector3f q = r * surfaces.camera.unproject(x, y, z).cast<float>() + t;
      if (q.z() < 0.2f) continue;
      const int u = static_cast<int>(std::lround(k.fx * q.x() / q.z() + k.cx));
      const int v = static_cast<int>(std::lround(k.fy * q.y() / q.z() + k.cy));
      if (!seen.depth_m.contains(u, v)) continue;
      const float nearest = seen.nearest_m.at(u, v);
      if (nearest <= 0) continue;
      ++result.visible;
      const float sigma = std::max(options.noise.sigma(z), options.noise.sigma(nearest));
      const float gate = std::max(static_cast<float>(options.gate_m), 3 * sigma);
      if (nearest > q.z() + gate) {
        tellThrough(x, y);
        continue;
      }
      const float d = seen.depth_m.at(u, v);
      if (d <= 0 || std::abs(d - q.z()) > gate) continue;
      ++result.agree;
      tellAgreement(Pair{x, y, u, v}, z, q.z());
    }
  return result;
}

}  // namespace

double agreedShare(const Sketch& surfaces, const Sketch& seen, const Pose& T_surfaces_seen,
                   const ComparisonOptions& options) {
  const Comparison placed = placeCells(
      surfaces, seen, T_surfaces_seen, options, [](int, int) {}, [](const Pair&, float, float) {});
  return placed.cells > 0 ? static_cast<double>(placed.agree) / static_cast<double>(placed.cells) : 0;
}

Comparison compareSketches(const Sketch& surfaces, const Sketch& seen, const Pose& T_surfaces_seen,
                           const ComparisonOptions& options) {
  const int width = surfaces.depth_m.width(), height = surfaces.depth_m.height();
  std::vector<Pair> comparable;
  Image<uint8_t> through(width, height), other_colour(width, height);
  Comparison result = placeCells(
      surfaces, seen, T_surfaces_seen, options, [&](int x, int y) { through.at(x, y) = 1; },
      [&](const Pair& pair, float z, float z_seen) {
        // From much nearer or farther, cells hold other shares of the same texture.
        const float scale = z_seen * static_cast<float>(surfaces.camera.fx) / (z * static_cast<float>(seen.camera.fx));
        if (scale > 1 / kComparableScale && scale < kComparableScale) comparable.push_back(pair);
      });
  result.through = solidCells(through);
  constexpr size_t kFewest = 100;
  if (comparable.size() < kFewest) return result;
  std::array<Exposure, 3> exposure;
  for (size_t c = 0; c < 3; ++c) exposure[c] = fitExposure(comparable, surfaces, seen, c);
  for (const Pair& p : comparable) {
    Levels wanted = levelsOf(surfaces.colour.at(p.x, p.y));
    for (size_t c = 0; c < 3; ++c)
      wanted[c] = std::clamp(exposure[c].gain * wanted[c] + exposure[c].bias, 0.0f, 255.0f);
    ++result.compared;
    other_colour.at(p.x, p.y) = discoloured(seen.colour, p.u, p.v, wanted, options.colour_levels);
  }
  result.discoloured = solidCells(other_colour);
  return result;
}

}  // namespace comap
