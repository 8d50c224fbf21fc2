#include "fleet_tools/metrics_surface.h"

#include <algorithm>
#include <cmath>
#include <nanoflann.hpp>
#include <vector>

#include "fleet_tools/synth_parallel.h"

namespace comap {
namespace {

using Eigen::Vector3f;

struct Cloud {
  const std::vector<Vector3f>& points;
  size_t kdtree_get_point_count() const { return points.size(); }
  float kdtree_get_pt(size_t i, size_t axis) const { return points[i][static_cast<Eigen::Index>(axis)]; }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};
using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Cloud>, Cloud, 3>;

struct Nearest {
  size_t index = 0;
  float distance_m = 0;
};

std::vector<Nearest> nearestOf(const std::vector<Vector3f>& queries, const std::vector<Vector3f>& points, int threads) {
  const Cloud cloud{points};
  const Tree tree(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(16));
  std::vector<Nearest> result(queries.size());
  constexpr size_t kBatch = 4096;
  const int batches = static_cast<int>((queries.size() + kBatch - 1) / kBatch);
  parallelFor(batches, threads, [&](int batch) {
    const size_t first = static_cast<size_t>(batch) * kBatch, last = std::min(queries.size(), first + kBatch);
    for (size_t i = first; i < last; ++i) {
      float squared = 0;
      nanoflann::KNNResultSet<float> found(1);
      found.init(&result[i].index, &squared);
      tree.findNeighbors(found, queries[i].data(), nanoflann::SearchParams());
      result[i].distance_m = std::sqrt(squared);
    }
  });
  return result;
}

double quantile(const std::vector<float>& sorted, double share) {
  const auto last = static_cast<double>(sorted.size() - 1);
  const auto low = static_cast<size_t>(share * last);
  const size_t high = std::min(low + 1, sorted.size() - 1);
  const double s = share * last - static_cast<double>(low);
  return (1 - s) * static_cast<double>(sorted[low]) + s * static_cast<double>(sorted[high]);
}

}  // namespace

SurfaceScore scoreSurface(const PlyPoints& map, const Pose& T_truth_map, const PlyPoints& truth, int threads) {
  std::vector<Vector3f> aligned;
  aligned.reserve(map.positions.size());
  for (const auto& p : map.positions) aligned.push_back((T_truth_map * p.cast<double>()).cast<float>());

  SurfaceScore score;
  score.map_points = aligned.size();
  score.truth_points = truth.positions.size();
  const auto to_truth = nearestOf(aligned, truth.positions, threads);
  std::vector<float> errors;
  errors.reserve(aligned.size());
  double sum = 0, plain = 0;
  for (size_t i = 0; i < aligned.size(); ++i) {
    const Nearest& nearest = to_truth[i];
    float error = nearest.distance_m;
    const bool has_normal = !truth.normals.empty() && truth.normals[nearest.index].squaredNorm() > 0.5f;
    if (has_normal && nearest.distance_m <= kPlaneReach_m) {
      error = std::abs(truth.normals[nearest.index].dot(aligned[i] - truth.positions[nearest.index]));
    }
    errors.push_back(error);
    sum += static_cast<double>(error);
    plain += static_cast<double>(nearest.distance_m);
  }
  std::sort(errors.begin(), errors.end());
  score.accuracy_mean_m = sum / static_cast<double>(errors.size());
  score.point_mean_m = plain / static_cast<double>(errors.size());
  score.accuracy_median_m = quantile(errors, 0.5);
  score.accuracy_p90_m = quantile(errors, 0.9);

  size_t complete = 0;
  for (const auto& nearest : nearestOf(truth.positions, aligned, threads)) {
    complete += nearest.distance_m <= kCompleteWithin_m ? 1 : 0;
  }
  score.completeness_2cm = static_cast<double>(complete) / static_cast<double>(truth.positions.size());
  return score;
}

}  // namespace comap
