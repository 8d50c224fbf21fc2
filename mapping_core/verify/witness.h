// What one keyframe has to say about a merge: held against the views of the other map that show the same surface.
#pragma once

#include <span>
#include <vector>

#include "mapping_core/verify/covisibility.h"
#include "mapping_core/verify/keyframe_shelf.h"
#include "mapping_core/verify/probation.h"

namespace comap {

struct Testimony {
  std::vector<ComparedViews> compared;
  Evidence evidence;
};

/// Those of `others` whose views `witness` overlaps by `overlap`, at most `count`, the most overlapping first.
std::vector<PlacedSketch> overlappingViews(const PlacedSketch& witness, std::span<const PlacedSketch> others,
                                           double overlap, size_t count);

/// Compares views of two keyframes that stand at T_a_b to each other. Where they contradict each other, they are
/// aligned: if that ends within the drift of a right merge and without contradiction, there is none.
class WitnessHearing {
 public:
  WitnessHearing(KeyframeShelf& shelf, const MergeCheckOptions& check, const CovisibilityOptions& tie,
                 const ProbationOptions& options);

  /// Errors are the shelf's.
  Result<Evidence> compare(const KeyframeId& a, const KeyframeId& b, const Pose& T_a_b);
  /// A new keyframe against the views of the other side; all stand in one map.
  Result<Testimony> hear(const PlacedSketch& witness, std::span<const PlacedSketch> others);

 private:
  KeyframeShelf& shelf_;
  MergeCheckOptions check_;
  CovisibilityOptions tie_;
  ProbationOptions options_;
  PointResiduals workspace_;
};

}  // namespace comap
