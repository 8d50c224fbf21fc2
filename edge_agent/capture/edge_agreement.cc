#include "edge_agent/capture/edge_agreement.h"

#include <algorithm>
#include <cmath>

namespace comap {
namespace {

constexpr double kJump = 0.05;
constexpr int kGap = 4;           // pixels without depth that an edge may have between its sides
constexpr float kStrongest = 40;  // so that a few bright edges do not decide
constexpr float kVisible = 12;    // grey levels a pixel
constexpr size_t kFewEdges = 300;
constexpr double kContrast = 1.3, kAgreeing_px = 1.5;

enum class Way { kAcross, kDown };

Image<float> greyOf(const ColourImage& colour) {
  Image<float> grey(colour.width(), colour.height());
  std::transform(colour.data(), colour.data() + colour.size(), grey.data(), [](const Rgb& c) {
    return 0.299f * static_cast<float>(c.r) + 0.587f * static_cast<float>(c.g) + 0.114f * static_cast<float>(c.b);
  });
  return grey;
}

// Grey levels a pixel, smoothed along the edge; between this pixel and the next one of its way.
float slope(const Image<float>& grey, int x, int y, Way way) {
  const int dx = way == Way::kAcross ? 1 : 0, dy = 1 - dx;
  float sum = 0;
  for (int k = -1; k <= 1; ++k) sum += grey.at(x + k * dy + dx, y + k * dx + dy) - grey.at(x + k * dy, y + k * dx);
  return std::min(std::abs(sum) / 3, kStrongest);
}

// The outermost pixel of a near thing beside a far one: calls back with the pixel before the boundary.
template <class Callback>
void forDepthEdges(const DepthImage& depth, Way way, int margin, Callback callback) {
  const int dx = way == Way::kAcross ? 1 : 0, dy = 1 - dx;
  for (int y = margin; y < depth.height() - margin; ++y) {
    for (int x = margin; x < depth.width() - margin; ++x) {
      const double here = depth.at(x, y);
      if (here == 0) continue;
      int step = 1;
      while (step <= kGap && depth.at(x + step * dx, y + step * dy) == 0) ++step;
      if (step > kGap) continue;
      const double there = depth.at(x + step * dx, y + step * dy);
      if (std::abs(here - there) <= kJump * std::min(here, there)) continue;
      // The boundary is that of the nearer side; what has no depth belongs to what it hides.
      const int last = here < there ? 0 : step - 1;
      callback(x + last * dx, y + last * dy);
    }
  }
}

// The top of the parabola through three values, from the middle one.
double peak(double before, double at, double after) {
  const double bend = before - 2 * at + after;
  return bend < 0 ? std::clamp(0.5 * (before - after) / bend, -0.5, 0.5) : 0;
}

}  // namespace

bool EdgeAgreement::determined() const { return edges >= kFewEdges && contrast >= kContrast; }
double EdgeAgreement::distance_px() const { return std::hypot(offset_x_px, offset_y_px); }
bool EdgeAgreement::agrees() const { return determined() && distance_px() <= kAgreeing_px; }

void EdgeComparison::add(const Frame& frame) {
  const Image<float> grey = greyOf(frame.colour);
  const int margin = kReach + kGap + 2;
  for (const Way way : {Way::kAcross, Way::kDown}) {
    Sums& sums = way == Way::kAcross ? across_ : down_;
    forDepthEdges(frame.depth, way, margin, [&](int x, int y) {
      ++sums.edges;
      double* strength = sums.strength.data();
      for (int v = -kReach; v <= kReach; ++v)
        for (int u = -kReach; u <= kReach; ++u) *strength++ += static_cast<double>(slope(grey, x + u, y + v, way));
    });
  }
}

EdgeAgreement EdgeComparison::result() const {
  EdgeAgreement result;
  result.edges = across_.edges + down_.edges;
  if (across_.edges < kFewEdges / 4 || down_.edges < kFewEdges / 4) {
    result.edges = std::min(result.edges, kFewEdges - 1);  // of one direction alone nothing is determined
    return result;
  }
  const double edges = static_cast<double>(result.edges);
  std::vector<double> strength(kSide * kSide);
  double mean = 0;
  for (size_t i = 0; i < strength.size(); ++i) {
    strength[i] = (across_.strength[i] + down_.strength[i]) / edges;
    mean += strength[i] / static_cast<double>(strength.size());
  }
  const auto best = std::max_element(strength.begin(), strength.end()) - strength.begin();
  const int u = static_cast<int>(best) % kSide, v = static_cast<int>(best) / kSide;
  const auto at = [&](int x, int y) { return strength[static_cast<size_t>(y * kSide + x)]; };
  result.offset_x_px = u - kReach + (u > 0 && u + 1 < kSide ? peak(at(u - 1, v), at(u, v), at(u + 1, v)) : 0);
  result.offset_y_px = v - kReach + (v > 0 && v + 1 < kSide ? peak(at(u, v - 1), at(u, v), at(u, v + 1)) : 0);
  result.out_of_reach = u == 0 || v == 0 || u + 1 == kSide || v + 1 == kSide;
  result.contrast = mean > 0 ? at(u, v) / mean : 0;
  return result;
}

ColourImage drawEdges(const Frame& frame) {
  const Image<float> grey = greyOf(frame.colour);
  ColourImage drawn(frame.colour.width(), frame.colour.height());
  std::transform(grey.data(), grey.data() + grey.size(), drawn.data(), [](float g) {
    const auto level = static_cast<uint8_t>(g);
    return Rgb{level, level, level};
  });
  for (const Way way : {Way::kAcross, Way::kDown}) {
    forDepthEdges(frame.depth, way, kGap + 3, [&](int x, int y) {
      bool seen = false;
      for (int k = -1; k <= 1; ++k)
        seen = seen || slope(grey, x + (way == Way::kAcross ? k : 0), y + (way == Way::kDown ? k : 0), way) >= kVisible;
      drawn.at(x, y) = seen ? Rgb{0, 255, 0} : Rgb{255, 0, 0};
    });
  }
  return drawn;
}

}  // namespace comap
