// Is it the same place, all in all? A hypothesis of how two maps lie to each other is held against everything that
// both have seen there, not only against the views that proposed it.
#pragma once

#include <span>

#include "mapping_core/verify/sketch.h"

namespace comap {

struct MergeCheckOptions {
  /// Share of the overlap (patches seen through or of another colour) beyond which two maps contradict each other.
  /// Static scenes stay below 0.0025 with poses wrong by 3 cm; look-alike rooms are at 0.015.
  double contradicted = 0.006;
  double view_overlap = 0.25;  ///< share of a view that the other must see to be asked
  size_t most_pairs = 150;     ///< of views; evenly spread if there are more
  ComparisonOptions comparison;
};

/// A keyframe and where it stands in its map.
struct PlacedSketch {
  const Sketch* sketch = nullptr;
  Pose T_map_cam;
};

/// Sums over pairs of views, both ways each.
struct Evidence {
  size_t views = 0;        ///< comparisons that overlap enough to tell anything
  size_t cells = 0;        ///< of surface that both sides claim to see
  size_t through = 0;      ///< of these in patches that one side looks through
  size_t discoloured = 0;  ///< and in patches that have another colour there

  double contradicted() const {
    return cells > 0 ? static_cast<double>(through + discoloured) / static_cast<double>(cells) : 0;
  }
  void add(const Comparison& comparison);
  void add(const Evidence& other);
};

/// Share of `a`'s surface that is in view of `b` (in front of it or hidden); quick, from a few cells.
double roughOverlap(const Sketch& a, const Sketch& b, const Pose& T_a_b);

/// What two views say about each other if b's camera stands at T_a_b in a's; nothing if they overlap too little.
Evidence compareViews(const Sketch& a, const Sketch& b, const Pose& T_a_b, const MergeCheckOptions& options);

/// What the views of two maps say about each other if b stands at T_a_b in a.
Evidence weighHypothesis(std::span<const PlacedSketch> a, std::span<const PlacedSketch> b, const Pose& T_a_b,
                         const MergeCheckOptions& options);

}  // namespace comap
