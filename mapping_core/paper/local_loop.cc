#include "mapping_core/paper/local_loop.h"

#include <algorithm>

#include "mapping_core/paper/map_deformation.h"

namespace comap {
namespace {

constexpr int kGridColumns = 32, kGridRows = 24;

// Points of the active surface, from where they are to where the inactive surface has them.
std::vector<DeformationConstraint> constraintsOf(const LoopContext& c, const TimedView& active,
                                                 const TimedView& inactive, const Pose& T_map_cam) {
  std::vector<DeformationConstraint> constraints;
  const CameraModel& model = c.camera.model;
  for (int row = 0; row < kGridRows; ++row)
    for (int column = 0; column < kGridColumns; ++column) {
      const int x = column * model.width / kGridColumns, y = row * model.height / kGridRows;
      const float z = active.view.depth_m.at(x, y);
      if (!(z > 0) || !(inactive.view.depth_m.at(x, y) > 0)) continue;
      const Eigen::Vector3d point = model.unproject(x, y, z);
      DeformationConstraint constraint;
      constraint.source = {c.camera.T_map_cam * point, {c.camera.index, c.tick}};
      constraint.target = {T_map_cam * point, c.owners[inactive.owners.at(x, y)]};
      constraint.pin = c.deformedAt() == 0;
      constraints.push_back(constraint);
    }
  return constraints;
}

// What was bent before stays as it is; so do other cameras' nodes where nodes belong to cameras.
std::vector<bool> frozenNodes(const LoopContext& c, const DeformationGraph& graph) {
  std::vector<bool> frozen;
  for (const DeformationNode& node : graph.nodes())
    frozen.push_back(node.time.tick <= c.deformedAt() && c.deformedAt() > 0);
  if (c.options.fixes.per_camera_graph)
    for (size_t n = 0; n < frozen.size(); ++n) frozen[n] = frozen[n] || graph.nodes()[n].time.camera != c.camera.index;
  return frozen;
}

void keepTies(const LoopContext& c, const DeformationGraph& graph,
              const std::vector<DeformationConstraint>& constraints) {
  for (const size_t i : {size_t{0}, constraints.size() / 3, 2 * constraints.size() / 3}) {
    const DeformationConstraint& one = constraints[i];
    const Eigen::Vector3d moved = one.source.position + graph.shift(graph.influence(one.source), one.source.position);
    c.frame.ties.push_back({moved, one.target.position, one.source.time, one.target.time});
  }
}

}  // namespace

Result<LoopReport> closeLocalLoop(const LoopContext& c, const TimedView& active) {
  LoopReport report;
  const ActiveRegion region(c.frame.map, c.camera, c.options, c.tick);
  auto inactive = region.predictInactive(c.camera.T_map_cam);
  if (!inactive) return inactive.error();
  Pyramid reference, frame;
  buildPyramid(inactive->view.colour, inactive->view.depth_m, c.camera.model, kDenseLevels, reference);
  buildPyramid(active.view.colour, active.view.depth_m, c.camera.model, kDenseLevels, frame);
  const auto registered = c.registrar.registerViews(reference, frame);
  if (!registered || !passes(registered->fit, c.options.closure, c.camera.model, c.options.fixes.independent_gates))
    return report;

  const Pose T_map_cam = c.camera.T_map_cam * registered->T_ref_cur;
  const auto constraints = constraintsOf(c, active, *inactive, T_map_cam);
  const auto surfels = c.frame.map.download();
  if (!surfels) return surfels.error();
  const DeformationOptions& options = c.options.graph;
  DeformationGraph graph = sampleGraph(*surfels, c.owners, options.stride, options.most_nodes, c.nodeOrder());
  const std::vector<bool> frozen = frozenNodes(c, graph);
  report.constraints = constraints.size();
  report.free_nodes = static_cast<size_t>(std::count(frozen.begin(), frozen.end(), false));
  // Where nothing may bend any more the camera goes where it belongs, and both surfaces become active: so it is with
  // all cameras of a map but the first that closes a loop in the same tick, unless each has nodes of its own.
  if (report.free_nodes > 0) {
    report.solve = solveDeformation(graph, constraints, frozen);
    if (!report.solve.solved) return report;
    if (auto moved = deformMap(c.frame.map, c.owners, graph, c.tick); !moved) return moved.error();
    keepTies(c, graph, constraints);
    c.movePoses(graph, c.options.fixes.correct_pose_log);
    c.deformedAt() = c.tick;
  }
  c.camera.T_map_cam = T_map_cam;
  const auto now = region.predictActive(T_map_cam);
  if (!now) return now.error();
  if (auto awake = region.reactivate(T_map_cam, now->view.depth_m); !awake) return awake.error();
  report.closed = true;
  return report;
}

}  // namespace comap
