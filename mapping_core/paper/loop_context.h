// What a loop within one map works on.
#pragma once

#include "mapping_core/paper/active_region.h"
#include "mapping_core/paper/deformation_solver.h"

namespace comap {

/// A loop that was looked for: whether it was closed, and by what numbers.
struct LoopReport {
  bool closed = false;
  size_t constraints = 0;  ///< points that were to be brought together
  size_t free_nodes = 0;   ///< of the graph, that could move; 0: the camera has moved and the map has not
  DeformationSolve solve;
};

struct LoopContext {
  ReferenceFrame& frame;
  std::vector<PaperCamera>& cameras;  ///< all of the core
  PaperCamera& camera;                ///< one of them: who may close a loop
  const std::vector<FrameTime>& owners;
  const PaperOptions& options;
  Registrar& registrar;
  uint32_t tick;

  NodeOrder nodeOrder() const { return options.fixes.per_camera_graph ? NodeOrder::kCameraTime : NodeOrder::kTime; }
  /// Tick of the last local deformation that binds this camera; 0 = none yet. One for the whole map; with nodes of
  /// their own each camera has its own.
  uint32_t& deformedAt() const { return options.fixes.per_camera_graph ? camera.deformed_at : frame.deformed_at; }
  /// Moves the poses that the map remembers places by; with `logs` also all that its cameras have been at.
  void movePoses(const DeformationGraph& graph, bool logs) const;
};

}  // namespace comap
