#include "mapping_core/merge/map_merger.h"

#include <cmath>

namespace comap {
namespace {

constexpr int kRounds = 10;
constexpr double kHuber = 0.03;  // metres, and radians weighed as metres at 1 m

}  // namespace

Pose averageTransform(std::span<const Closure> closures, const std::map<KeyframeId, Pose>& T_map_cam) {
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  // in b
  for (const Closure& closure : closures) centre += T_map_cam.at(closure.query).translation();
  centre /= static_cast<double>(closures.size());
  const Pose T_b_centre(Eigen::Quaterniond::Identity(), centre);

  std::vector<Pose> T_a_centre;
  for (const Closure& closure : closures)
    T_a_centre.push_back(queryInCandidateMap(closure, T_map_cam) * T_map_cam.at(closure.query).inverse() * T_b_centre);
  Pose mean = T_a_centre.front();
  for (int round = 0; round < kRounds; ++round) {
    Vector6d step = Vector6d::Zero();
    double total = 0;
    for (const Pose& one : T_a_centre) {
      const Vector6d difference = (mean.inverse() * one).log();
      const double weight = kHuber / std::max(kHuber, difference.norm());
      step += weight * difference;
      total += weight;
    }
    mean = mean * Pose::exp(step / total);
  }
  return mean * T_b_centre.inverse();
}

}  // namespace comap
