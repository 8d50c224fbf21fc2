#include "fleet_tools/view/map_frame.h"

#include <algorithm>

#include "fleet_tools/render/surfel_renderer.h"
#include "mapping_core/tiles/tile_builder.h"

namespace comap {
namespace {

constexpr size_t kSample = 60000;
constexpr double kOutliers = 0.01;  // share at either end

std::vector<Surfel> sampleOf(std::span<const Tile* const> tiles) {
  size_t all = 0;
  for (const Tile* tile : tiles) all += tile->surfels.size();
  const size_t step = std::max<size_t>(1, all / kSample);
  std::vector<Surfel> sample;
  size_t number = 0;
  for (const Tile* tile : tiles)
    for (const TileSurfel& surfel : tile->surfels)
      if (number++ % step == 0) sample.push_back(dequantise(surfel, tile->key));
  return sample;
}

std::pair<double, double> rangeOf(std::vector<double> values) {
  if (values.empty()) return {0, 0};
  const auto at = [&](double share) {
    const auto nth = values.begin() + static_cast<ptrdiff_t>(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), nth, values.end());
    return *nth;
  };
  return {at(kOutliers), at(1 - kOutliers)};
}

}  // namespace

MapFrame mapFrame(std::span<const Tile* const> tiles, std::span<const Pose> T_map_cams) {
  const std::vector<Surfel> sample = sampleOf(tiles);
  std::vector<Eigen::Vector3d> points;
  for (const Surfel& surfel : sample) points.push_back(surfel.position.cast<double>());
  if (points.empty())
    for (const Pose& pose : T_map_cams) points.push_back(pose.translation());
  MapFrame frame;
  frame.up = upDirection(sample, T_map_cams);
  if (points.empty()) return frame;
  std::vector<double> heights;
  for (const auto& point : points) heights.push_back(frame.up.dot(point));
  std::tie(frame.low_m, frame.high_m) = rangeOf(heights);
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const auto& point : points) values.push_back(point[axis]);
    const auto [low, high] = rangeOf(std::move(values));
    frame.centre[axis] = (low + high) / 2;
  }
  for (const Pose& pose : T_map_cams) {  // ways lead beyond what was seen
    const double height = frame.up.dot(pose.translation());
    frame.low_m = std::min(frame.low_m, height);
    frame.high_m = std::max(frame.high_m, height);
  }
  std::vector<double> distances;
  for (const auto& point : points) distances.push_back((point - frame.centre).norm());
  frame.radius_m = std::max(0.5, rangeOf(std::move(distances)).second);
  for (const Pose& pose : T_map_cams)
    frame.radius_m = std::max(frame.radius_m, (pose.translation() - frame.centre).norm());
  return frame;
}

}  // namespace comap
