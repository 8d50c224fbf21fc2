#include "mapping_core/paper/global_loop.h"

#include <algorithm>

#include "mapping_core/paper/map_deformation.h"

namespace comap {
namespace {

constexpr int kEvery = 8;  // pixels of the small view, between two constraints

bool isOld(const LoopContext& c, const FernPlace& place) {
  return place.time.camera != c.camera.index || place.time.tick + c.options.ferns.min_age < c.tick;
}

std::vector<DeformationConstraint> constraintsOf(const LoopContext& c, const FernView& seen, const Pose& T_map_cam,
                                                 FrameTime place_time) {
  std::vector<DeformationConstraint> constraints;
  const PyramidLevel& level = seen.pyramid[kSmallLevel];
  for (int y = kEvery / 2; y < level.depth_m.height(); y += kEvery)
    for (int x = kEvery / 2; x < level.depth_m.width(); x += kEvery) {
      const float z = level.depth_m.at(x, y);
      if (!(z > 0)) continue;
      const Eigen::Vector3d point = level.camera.unproject(x, y, z);
      constraints.push_back(
          {{c.camera.T_map_cam * point, {c.camera.index, c.tick}}, {T_map_cam * point, place_time}, true});
    }
  return constraints;
}

}  // namespace

bool mayCloseGlobalLoop(const LoopContext& c) {
  if (c.frame.merged_at > 0 && c.tick <= c.frame.merged_at + c.options.graph.pause_after_merge) return false;
  const auto& places = c.frame.ferns.places();
  return std::any_of(places.begin(), places.end(), [&](const FernPlace& place) { return isOld(c, place); });
}

Result<LoopReport> closeGlobalLoop(const LoopContext& c, const FernView& seen) {
  LoopReport report;
  const auto match = c.frame.ferns.match(
      seen, [&](const FernPlace& place) { return isOld(c, place); }, c.registrar);
  if (!match) return report;
  const FernPlace& place = c.frame.ferns.places()[match->place];
  const Pose T_map_cam = place.T_map_cam * match->T_place_cam;
  auto constraints = constraintsOf(c, seen, T_map_cam, place.time);
  if (constraints.empty()) return report;
  double drift = 0;
  for (const auto& one : constraints) drift += (one.target.position - one.source.position).norm();
  if (drift / static_cast<double>(constraints.size()) < c.options.ferns.least_drift_m) return report;
  for (const Tie& tie : c.frame.ties)
    constraints.push_back({{tie.source, tie.source_time}, {tie.target, tie.target_time}, false, true});

  const auto surfels = c.frame.map.download();
  if (!surfels) return surfels.error();
  const DeformationOptions& options = c.options.graph;
  DeformationGraph graph =
      sampleGraph(*surfels, c.owners, options.stride * options.global_share, options.most_nodes, c.nodeOrder());
  report.constraints = constraints.size();
  report.free_nodes = graph.nodes().size();
  report.solve = solveDeformation(graph, constraints, {});
  if (!report.solve.solved || report.solve.mean_error_m >= options.global_error_m ||
      report.solve.cost >= options.global_cost)
    return report;
  if (auto moved = deformMap(c.frame.map, c.owners, graph, c.tick); !moved) return moved.error();
  for (Tie& tie : c.frame.ties) {
    tie.source += graph.shift(graph.influence({tie.source, tie.source_time}), tie.source);
    tie.target += graph.shift(graph.influence({tie.target, tie.target_time}), tie.target);
  }
  c.movePoses(graph, true);
  c.camera.T_map_cam = T_map_cam;
  report.closed = true;
  return report;
}

}  // namespace comap
