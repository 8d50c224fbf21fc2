#include "fleet_tools/evaluate/metrics_surface.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "fleet_tools/evaluate/point_tree.h"
#include "fleet_tools/synth/synth_parallel.h"

namespace comap {
namespace {

using Eigen::Vector3f;

struct Nearest {
  size_t index = 0;
  float distance_m = 0;
};

std::vector<Nearest> nearestOf(const std::vector<Vector3f>& queries, const std::vector<Vector3f>& points, int threads) {
  const PointCloud cloud{points};
  const PointTree tree(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(16));
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

float distanceToDisc(const Vector3f& query, const Vector3f& centre, const Vector3f& normal, float radius) {
  const Vector3f offset = query - centre;
  const float height = normal.dot(offset);
  const float beyond = std::max(0.0f, std::sqrt(std::max(0.0f, offset.squaredNorm() - height * height)) - radius);
  return std::sqrt(height * height + beyond * beyond);
}

// Which of the truth's points that have no map point near lie near a map point's disc.
std::vector<uint8_t> nearDisc(const std::vector<Vector3f>& queries, const std::vector<Nearest>& nearest,
                              const std::vector<Vector3f>& centres, const PlyPoints& map, const Eigen::Matrix3f& R,
                              int threads) {
  std::vector<uint8_t> result(queries.size(), 0);
  if (map.radii.empty() || map.normals.empty()) return result;
  const PointCloud cloud{centres};
  const PointTree tree(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(16));
  const float largest = *std::max_element(map.radii.begin(), map.radii.end()) + kCompleteWithin_m;
  constexpr size_t kBatch = 4096;
  parallelFor(static_cast<int>((queries.size() + kBatch - 1) / kBatch), threads, [&](int batch) {
    const size_t first = static_cast<size_t>(batch) * kBatch;
    std::vector<std::pair<uint32_t, float>> near;
    const nanoflann::SearchParams unsorted(32, 0, false);
    for (size_t i = first; i < std::min(queries.size(), first + kBatch); ++i) {
      if (nearest[i].distance_m <= kCompleteWithin_m || nearest[i].distance_m > largest) continue;
      tree.radiusSearch(queries[i].data(), largest * largest, near, unsorted);
      result[i] = std::any_of(near.begin(), near.end(), [&](const auto& n) {
        return distanceToDisc(queries[i], centres[n.first], R * map.normals[n.first], map.radii[n.first]) <=
               kCompleteWithin_m;
      });
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

SurfaceScore scoreSurface(const PlyPoints& map, const Pose& T_truth_map, const PlyPoints& truth, int threads,
                          std::span<const uint8_t> seen) {
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

  size_t complete = 0, complete_seen = 0, covered_seen = 0;
  const auto to_map = nearestOf(truth.positions, aligned, threads);
  const Eigen::Matrix3f R_truth_map = T_truth_map.rotationMatrix().cast<float>();
  const auto on_disc = nearDisc(truth.positions, to_map, aligned, map, R_truth_map, threads);
  for (size_t i = 0; i < to_map.size(); ++i) {
    const bool covered = to_map[i].distance_m <= kCompleteWithin_m, was_seen = !seen.empty() && seen[i] != 0;
    complete += covered;
    score.truth_points_seen += was_seen;
    complete_seen += covered && was_seen;
    covered_seen += (covered || on_disc[i] != 0) && was_seen;
  }
  score.completeness_2cm = static_cast<double>(complete) / static_cast<double>(truth.positions.size());
  if (score.truth_points_seen > 0) {
    const auto all = static_cast<double>(score.truth_points_seen);
    score.completeness_seen_2cm = static_cast<double>(complete_seen) / all;
    score.covered_seen_2cm = static_cast<double>(covered_seen) / all;
  }
  return score;
}

}  // namespace comap
