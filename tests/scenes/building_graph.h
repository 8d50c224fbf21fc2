// A keyframe graph with exact truth: robots walk the corridors of a building, odometry drifts, places come again.
#pragma once

#include <vector>

#include "mapping_core/graph/edge.h"

namespace comap {

struct BuildingOptions {
  int keyframes = 1000;
  int robots = 4;
  int covisible = 4;            ///< covisibility edges a keyframe to those just before it
  double closures = 5;          ///< closures a keyframe to earlier visits of its place, at most
  double false_share = 0;       ///< of the closures, replaced by wrong ones
  bool false_in_pairs = false;  ///< wrong closures come in twos that agree with each other
  double sigma_odometry_m = 0.003, sigma_odometry_rad = 0.001;
  double sigma_closure_m = 0.005, sigma_closure_rad = 0.002;
  unsigned seed = 1;
};

/// In order of arrival: robots take turns, and an edge arrives with the later of its ends.
struct BuildingGraph {
  struct Keyframe {
    KeyframeId id;
    Pose T_map_cam;                ///< truth
    Pose T_map_odometry;           ///< odometry alone, from the robot's true first pose
    std::vector<Edge> edges;       ///< to keyframes before it, odometry first
    std::vector<bool> edge_false;  ///< per edge
  };
  std::vector<Keyframe> keyframes;
  size_t edges = 0, false_edges = 0;
};

BuildingGraph makeBuildingGraph(const BuildingOptions& options);

}  // namespace comap
