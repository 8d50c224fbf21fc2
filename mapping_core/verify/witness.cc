#include "mapping_core/verify/witness.h"

#include <algorithm>

namespace comap {

std::vector<PlacedSketch> overlappingViews(const PlacedSketch& witness, std::span<const PlacedSketch> others,
                                           double overlap, size_t count) {
  std::vector<std::pair<double, size_t>> found;
  for (size_t i = 0; i < others.size(); ++i) {
    const Pose T_witness_other = witness.T_map_cam.inverse() * others[i].T_map_cam;
    const double share = roughOverlap(*witness.sketch, *others[i].sketch, T_witness_other);
    if (share >= overlap) found.emplace_back(-share, i);
  }
  std::sort(found.begin(), found.end());
  if (found.size() > count) found.resize(count);
  std::vector<PlacedSketch> views;
  for (const auto& [share, i] : found) views.push_back(others[i]);
  return views;
}

WitnessHearing::WitnessHearing(KeyframeShelf& shelf, const MergeCheckOptions& check, const CovisibilityOptions& tie,
                               const ProbationOptions& options)
    : shelf_(shelf), check_(check), tie_(tie), options_(options) {
  tie_.explained_m = options_.drift_m;
  tie_.explained_rad = options_.drift_rad;
}

Result<Evidence> WitnessHearing::compare(const KeyframeId& a, const KeyframeId& b, const Pose& T_a_b) {
  const auto a_sketch = shelf_.sketch(a);
  if (!a_sketch) return a_sketch.error();
  const auto b_sketch = shelf_.sketch(b);
  if (!b_sketch) return b_sketch.error();
  const Evidence seen = compareViews(**a_sketch, **b_sketch, T_a_b, check_);
  if (seen.contradicted() <= options_.contradicted) return seen;
  const auto a_view = shelf_.view(a);
  if (!a_view) return a_view.error();
  const auto b_view = shelf_.view(b);
  if (!b_view) return b_view.error();
  const auto aligned = alignCovisible(**a_view, **b_view, T_a_b, tie_, workspace_);
  if (!aligned) return seen;
  const Evidence explained = compareViews(**a_sketch, **b_sketch, aligned->T_from_to, check_);
  return explained.views > 0 && explained.contradicted() <= options_.contradicted ? explained : seen;
}

Result<Testimony> WitnessHearing::hear(const PlacedSketch& witness, std::span<const PlacedSketch> others) {
  Testimony testimony;
  for (const PlacedSketch& other : overlappingViews(witness, others, check_.view_overlap, options_.views)) {
    const KeyframeId &a = witness.sketch->id, &b = other.sketch->id;
    const auto seen = compare(a, b, witness.T_map_cam.inverse() * other.T_map_cam);
    if (!seen) return seen.error();
    if (seen->views == 0) continue;
    testimony.compared.emplace_back(a, b);
    testimony.evidence.add(*seen);
  }
  return testimony;
}

}  // namespace comap
