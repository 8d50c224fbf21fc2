#include "fleet_tools/evaluate/metrics_doubles.h"

#include <algorithm>
#include <numeric>

#include "fleet_tools/evaluate/point_tree.h"
#include "fleet_tools/synth/synth_parallel.h"

namespace comap {
namespace {

bool liesBehind(const PlyPoints& map, size_t point, size_t other) {
  const Eigen::Vector3f& normal = map.normals[other];
  if (normal.dot(map.normals[point]) < kDoubleCosine) return false;
  const Eigen::Vector3f offset = map.positions[other] - map.positions[point];
  const float height = normal.dot(offset);
  if (height < kDoubleNearest_m || height > kDoubleFarthest_m) return false;
  const float reach = map.radii.empty() ? kDoubleReach_m : std::min(map.radii[other], kMostDoubleReach_m);
  return offset.squaredNorm() - height * height <= reach * reach;
}

}  // namespace

DoubleSurface findDoubles(const PlyPoints& map, int threads) {
  DoubleSurface found;
  if (map.normals.empty()) return found;
  const PointCloud cloud{map.positions};
  const PointTree tree(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(16));
  constexpr float kSearch2 = kDoubleFarthest_m * kDoubleFarthest_m + kMostDoubleReach_m * kMostDoubleReach_m;
  constexpr size_t kBatch = 4096;
  const size_t count = map.positions.size();
  std::vector<DoubleSurface> parts((count + kBatch - 1) / kBatch);
  parallelFor(static_cast<int>(parts.size()), threads, [&](int batch) {
    DoubleSurface& part = parts[static_cast<size_t>(batch)];
    const size_t first = static_cast<size_t>(batch) * kBatch;
    std::vector<std::pair<uint32_t, float>> near;
    const nanoflann::SearchParams unsorted(32, 0, false);
    for (size_t i = first; i < std::min(count, first + kBatch); ++i) {
      if (map.normals[i].squaredNorm() < 0.5f) continue;
      ++part.points;
      tree.radiusSearch(map.positions[i].data(), kSearch2, near, unsorted);
      part.doubled += std::any_of(near.begin(), near.end(), [&](const auto& n) { return liesBehind(map, i, n.first); });
    }
  });
  for (const DoubleSurface& part : parts) {
    found.points += part.points;
    found.doubled += part.doubled;
  }
  return found;
}

}  // namespace comap
