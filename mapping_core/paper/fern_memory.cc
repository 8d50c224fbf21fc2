#include "mapping_core/paper/fern_memory.h"

#include <cmath>
#include <cstdlib>

#include "mapping_core/ferns/fern_encoder.h"

namespace comap {
namespace {

constexpr int kShrink = 8;
constexpr double kSmallPixels = 80.0 * 60.0;

ColourImage shrinkColour(const ColourImage& colour) {
  ColourImage small(colour.width() / kShrink, colour.height() / kShrink);
  for (int y = 0; y < small.height(); ++y)
    for (int x = 0; x < small.width(); ++x) {
      unsigned r = 0, g = 0, b = 0;
      for (int v = 0; v < kShrink; ++v)
        for (int u = 0; u < kShrink; ++u) {
          const Rgb& c = colour.at(x * kShrink + u, y * kShrink + v);
          r += c.r;
          g += c.g;
          b += c.b;
        }
      constexpr unsigned kPixels = kShrink * kShrink;
      small.at(x, y) = {static_cast<uint8_t>(r / kPixels), static_cast<uint8_t>(g / kPixels),
                        static_cast<uint8_t>(b / kPixels)};
    }
  return small;
}

// Mean of |dR| + |dG| + |dB| where the query's surface falls into the place's picture; 765 if it does nowhere.
double colourDifference(const FernView& place, const FernView& query, const Pose& T_place_cam) {
  const PyramidLevel &to = place.pyramid[kSmallLevel], &from = query.pyramid[kSmallLevel];
  uint64_t sum = 0, count = 0;
  for (int y = 0; y < from.depth_m.height(); ++y)
    for (int x = 0; x < from.depth_m.width(); ++x) {
      const float z = from.depth_m.at(x, y);
      if (!(z > 0)) continue;
      const Eigen::Vector3d p = T_place_cam * from.camera.unproject(x, y, z);
      if (p.z() < 0.05) continue;
      const Eigen::Vector2d at = to.camera.project(p);
      const int u = static_cast<int>(std::lround(at.x())), v = static_cast<int>(std::lround(at.y()));
      if (!to.depth_m.contains(u, v) || !(to.depth_m.at(u, v) > 0)) continue;
      const Rgb &a = query.colour.at(x, y), &b = place.colour.at(u, v);
      sum += static_cast<uint64_t>(std::abs(a.r - b.r) + std::abs(a.g - b.g) + std::abs(a.b - b.b));
      ++count;
    }
  return count > 0 ? static_cast<double>(sum) / static_cast<double>(count) : 765;
}

}  // namespace

FernView fernViewOf(const FernBook& book, const FilledView& view, const CameraModel& camera) {
  FernView small;
  small.code = encodeFerns(book, view.colour, depthUnits(view.depth_m));
  Pyramid pyramid;
  buildPyramid(view.colour, view.depth_m, camera, kSmallLevel + 1, pyramid);
  small.pyramid.resize(kSmallLevel + 1);
  small.pyramid[kSmallLevel] = std::move(pyramid[kSmallLevel]);
  small.colour = shrinkColour(view.colour);
  return small;
}

bool FernMemory::harvest(FernView view, FrameTime time, const Pose& T_map_cam) {
  const auto nearest = index_.query(view.code, 1, [](uint32_t) { return true; });
  if (!nearest.empty() && nearest.front().dissimilarity <= options_.harvest_dissimilarity) return false;
  if (!index_.add(static_cast<uint32_t>(places_.size()), view.code)) return false;
  places_.push_back({std::move(view), time, T_map_cam});
  return true;
}

std::optional<FernMatch> FernMemory::match(const FernView& query, const std::function<bool(const FernPlace&)>& admit,
                                           Registrar& registrar) const {
  const auto found = index_.query(
      query.code, 1, [&](uint32_t place) { return admit(places_[place]); }, options_.match_dissimilarity);
  if (found.empty()) return std::nullopt;
  FernMatch match;
  match.place = found.front().place;
  const FernView& place = places_[match.place].view;
  const Alignment aligned = registrar.alignSmall(place.pyramid, query.pyramid);
  if (!aligned.solved) return std::nullopt;
  match.T_place_cam = aligned.T_ref_cur;
  const Fit fit = fitOf(place.pyramid, query.pyramid, kSmallLevel, match.T_place_cam);
  const CameraModel& camera = query.pyramid[kSmallLevel].camera;
  const double scale = static_cast<double>(camera.width) * camera.height / kSmallPixels;
  if (fit.error >= options_.error / std::sqrt(scale) || static_cast<double>(fit.inliers) <= options_.inliers * scale)
    return std::nullopt;
  if (colourDifference(place, query, match.T_place_cam) >= options_.photometric) return std::nullopt;
  return match;
}

void FernMemory::absorb(FernMemory&& other, const Pose& T_map_other) {
  for (FernPlace& place : other.places_) {
    place.T_map_cam = T_map_other * place.T_map_cam;
    index_.add(static_cast<uint32_t>(places_.size()), place.view.code);
    places_.push_back(std::move(place));
  }
  other.places_.clear();
}

}  // namespace comap
