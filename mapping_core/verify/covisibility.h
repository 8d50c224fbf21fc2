// Keyframes of one map that see the same surface from near, and how they lie to each other: the ties that keep a map
// from bending between its loops.
#pragma once

#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "mapping_core/graph/edge.h"
#include "mapping_core/rgbd/alignment.h"
#include "mapping_core/verify/keyframe_view.h"
#include "mapping_core/verify/merge_check.h"

namespace comap {

struct CovisibilityOptions {
  double overlap = 0.3;       ///< share of a view that the other agrees to see
  size_t per_keyframe = 6;    ///< ties of one keyframe to earlier ones, the most overlapping first
  double inlier_ratio = 0.6;  ///< of the alignment, both ways
  double degeneracy = 1e-3;   ///< below it a direction is hardly measured
  /// How far an alignment may end from where the map had the pair: more is not explained by this map, but perhaps by
  /// another surface (two sides of a thin wall).
  double explained_m = 0.05, explained_rad = 0.035;
  double moved_m = 0.002, moved_rad = 0.00087;  ///< a pair is measured anew only if the map has moved it by more
  double round_trip_m = 0.02, round_trip_rad = 0.0175;
  DepthNoiseModel noise;
};

/// For the keyframe `query` those of `others` it overlaps with, at most `per_keyframe`, the most overlapping first;
/// positions in `others`. `query` itself may be among them.
std::vector<size_t> covisibleWith(const PlacedSketch& query, std::span<const PlacedSketch> others,
                                  const CovisibilityOptions& options, const ComparisonOptions& comparison);

/// Measures the pose between two keyframes of one map, from T_from_to as the map has it. The mean of both ways, so that
/// neither's borders count alone; nothing if it is not well determined. Thread rule: `workspace` is of one thread.
std::optional<Edge> alignCovisible(const KeyframeView& from, const KeyframeView& to, const Pose& T_from_to,
                                   const CovisibilityOptions& options, PointResiduals& workspace);

}  // namespace comap
