// What two sketches say about each other. Maps that are to be joined are compared view by view, hundreds of pairs while
// all else waits, so nothing is computed twice here.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

#include "mapping_core/verify/sketch.h"

namespace comap {
namespace {

constexpr float kComparableScale = 1.4f;

using Levels = std::array<float, 3>;

Levels levelsOf(const Rgb& c) { return {static_cast<float>(c.r), static_cast<float>(c.g), static_cast<float>(c.b)}; }

struct Pair {
  int x, y;  // cell of the surfaces
  int u, v;  // and where it is seen
};

// The middle one of values that are not negative, as std::nth_element finds it: bits of such floats rise with them, so
// a count of their first bits says among which few it is.
float middleOf(const std::vector<float>& values, std::vector<float>& scratch) {
  constexpr int kShift = 20;
  std::array<uint32_t, (1u << (32 - kShift))> counts{};
  for (const float value : values) ++counts[std::bit_cast<uint32_t>(value) >> kShift];
  size_t wanted = values.size() / 2, bin = 0;
  while (wanted >= counts[bin]) wanted -= counts[bin++];
  scratch.clear();
  for (const float value : values)
    if (std::bit_cast<uint32_t>(value) >> kShift == bin) scratch.push_back(value);
  const auto middle = scratch.begin() + static_cast<std::ptrdiff_t>(wanted);
  std::nth_element(scratch.begin(), middle, scratch.end());
  return *middle;
}

// Gain and bias of one channel, by least squares over those pairs that fit; near (1, 0) where nothing varies.
struct Exposure {
  float gain = 1, bias = 0;
};

Exposure fitExposure(const std::vector<Pair>& pairs, const Sketch& surfaces, const Sketch& seen, size_t channel) {
  constexpr int kRounds = 4;
  constexpr double kPriorVariance = 100;
  Exposure exposure;
  std::vector<float> wanted(pairs.size()), found(pairs.size()), residuals(pairs.size()), scratch;
  for (size_t i = 0; i < pairs.size(); ++i) {
    wanted[i] = levelsOf(surfaces.colour.at(pairs[i].x, pairs[i].y))[channel];
    found[i] = levelsOf(seen.colour.at(pairs[i].u, pairs[i].v))[channel];
  }
  for (int round = 0; round < kRounds; ++round) {
    for (size_t i = 0; i < pairs.size(); ++i)
      residuals[i] = std::abs(found[i] - (exposure.gain * wanted[i] + exposure.bias));
    float most = 0;
    if (round > 0) most = std::max(6.0f, 3 * 1.4826f * middleOf(residuals, scratch));
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

using Row = std::vector<uint8_t>;

// Of each byte and those three before and after it, which are the neighbours' of the same channel.
template <class Pick>
void pickAlong(const uint8_t* row, size_t bytes, const Pick& pick, Row& out) {
  if (bytes < 6) {
    std::copy_n(row, bytes, out.begin());
    return;
  }
  for (size_t i = 3; i + 3 < bytes; ++i) out[i] = pick(pick(row[i - 3], row[i]), row[i + 3]);
  for (size_t i = 0; i < 3; ++i) {
    out[i] = pick(row[i], row[i + 3]);
    out[bytes - 3 + i] = pick(row[bytes - 6 + i], row[bytes - 3 + i]);
  }
}

// The lowest or highest levels of each cell and its neighbours.
template <class Pick>
ColourImage pickAround(const ColourImage& colour, const Pick& pick) {
  static_assert(sizeof(Rgb) == 3);
  const int height = colour.height();
  const size_t bytes = size_t{3} * static_cast<size_t>(colour.width());
  std::vector<Row> rows(static_cast<size_t>(height), Row(bytes));
  for (int y = 0; y < height; ++y)
    pickAlong(reinterpret_cast<const uint8_t*>(colour.row(y)), bytes, pick, rows[static_cast<size_t>(y)]);
  ColourImage result(colour.width(), height);
  for (int y = 0; y < height; ++y) {
    const uint8_t* above = rows[static_cast<size_t>(std::max(0, y - 1))].data();
    const uint8_t* here = rows[static_cast<size_t>(y)].data();
    const uint8_t* below = rows[static_cast<size_t>(std::min(height - 1, y + 1))].data();
    auto* out = reinterpret_cast<uint8_t*>(result.row(y));
    for (size_t i = 0; i < bytes; ++i) out[i] = pick(pick(above[i], here[i]), below[i]);
  }
  return result;
}

// Whether `wanted` lies outside of all that a cell and its neighbours show: a shift by a cell is no other colour.
bool discoloured(const Rgb& lowest, const Rgb& highest, const Levels& wanted, float levels) {
  const Levels low = levelsOf(lowest), high = levelsOf(highest);
  for (size_t i = 0; i < 3; ++i)
    if (wanted[i] < low[i] - levels || wanted[i] > high[i] + levels) return true;
  return false;
}

// Cells set whose neighbours are set too, but for two: patches count, what flickers along edges does not.
size_t solidCells(const Image<uint8_t>& cells) {
  constexpr int kSolid = 7;  // of nine
  size_t solid = 0;
  for (int y = 1; y + 1 < cells.height(); ++y) {
    const uint8_t *above = cells.row(y - 1), *here = cells.row(y), *below = cells.row(y + 1);
    for (int x = 1; x + 1 < cells.width(); ++x) {
      if (here[x] == 0) continue;
      int sum = 0;
      for (int u = x - 1; u <= x + 1; ++u) sum += above[u] + here[u] + below[u];
      solid += sum >= kSolid;
    }
  }
  return solid;
}

// As std::lround, of what is far from the ends of int.
int rounded(double value) {
  const int whole = static_cast<int>(value);
  const double rest = value - whole;
  return whole + (rest >= 0.5) - (rest <= -0.5);
}

// Where the cells of `surfaces` fall in `seen`: counts all but colours, and tells of each cell that agrees or is seen
// through.
template <class Through, class Agree>
Comparison placeCells(const Sketch& surfaces, const Sketch& seen, const Pose& T_surfaces_seen,
                      const ComparisonOptions& options, const Through& tellThrough, const Agree& tellAgreement) {
  const Pose T_seen_surfaces = T_surfaces_seen.inverse();
  const Eigen::Matrix3f r = T_seen_surfaces.rotationMatrix().cast<float>();
  const Eigen::Vector3f t = T_seen_surfaces.translation().cast<float>();
  const CameraModel &k = seen.camera, &own = surfaces.camera;
  const int width = surfaces.depth_m.width();
  std::vector<double> across(static_cast<size_t>(width));  // of the rays of columns
  for (int x = 0; x < width; ++x) across[static_cast<size_t>(x)] = (x - own.cx) / own.fx;
  const double right = seen.depth_m.width(), bottom = seen.depth_m.height();
  const float least_gate = static_cast<float>(options.gate_m);
  Comparison result;
  for (int y = 0; y < surfaces.depth_m.height(); ++y) {
    const float* depths = surfaces.depth_m.row(y);
    const double down = (y - own.cy) / own.fy;
    for (int x = 0; x < width; ++x) {
      const float z = depths[x];
      if (z <= 0) continue;
      ++result.cells;
      const double far = z;
      const Eigen::Vector3f p(static_cast<float>(across[static_cast<size_t>(x)] * far), static_cast<float>(down * far),
                              z);
      const Eigen::Vector3f q = r * p + t;
      if (q.z() < 0.2f) continue;
      const double at_x = k.fx * q.x() / q.z() + k.cx, at_y = k.fy * q.y() / q.z() + k.cy;
      if (!(at_x > -1 && at_y > -1 && at_x < right && at_y < bottom)) continue;
      const int u = rounded(at_x), v = rounded(at_y);
      if (!seen.depth_m.contains(u, v)) continue;
      const float nearest = seen.nearest_m.at(u, v);
      if (nearest <= 0) continue;
      ++result.visible;
      const float sigma = std::max(options.noise.sigma(z), options.noise.sigma(nearest));
      const float gate = std::max(least_gate, 3 * sigma);
      if (nearest > q.z() + gate) {
        tellThrough(x, y);
        continue;
      }
      const float d = seen.depth_m.at(u, v);
      if (d <= 0 || std::abs(d - q.z()) > gate) continue;
      ++result.agree;
      tellAgreement(Pair{x, y, u, v}, z, q.z());
    }
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
  const ColourImage lowest = pickAround(seen.colour, [](uint8_t a, uint8_t b) { return std::min(a, b); });
  const ColourImage highest = pickAround(seen.colour, [](uint8_t a, uint8_t b) { return std::max(a, b); });
  for (const Pair& p : comparable) {
    Levels wanted = levelsOf(surfaces.colour.at(p.x, p.y));
    for (size_t c = 0; c < 3; ++c)
      wanted[c] = std::clamp(exposure[c].gain * wanted[c] + exposure[c].bias, 0.0f, 255.0f);
    ++result.compared;
    other_colour.at(p.x, p.y) = discoloured(lowest.at(p.u, p.v), highest.at(p.u, p.v), wanted, options.colour_levels);
  }
  result.discoloured = solidCells(other_colour);
  return result;
}

}  // namespace comap
