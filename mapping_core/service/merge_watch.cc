#include "mapping_core/service/merge_watch.h"

#include <algorithm>

namespace comap {
namespace {

Confirmation heardOf(const Probation& probation) {
  return {probation.merge(), probation.witnesses(), probation.supporters(), probation.evidence().contradicted()};
}

}  // namespace

MergeSides mergeSides(std::span<const KeyframeId> first, std::span<const KeyframeId> second) {
  MergeSides sides;
  for (const KeyframeId& id : first) sides[id] = false;
  for (const KeyframeId& id : second) sides[id] = true;
  return sides;
}

void MergeWatch::open(Probation probation, std::vector<KeyframeId> unheard) {
  watched_.push_back({std::move(probation), std::move(unheard)});
}

void MergeWatch::close(uint32_t merge) {
  std::erase_if(watched_, [&](const Watched& one) { return one.probation.merge() == merge; });
}

std::vector<uint32_t> MergeWatch::merges() const {
  std::vector<uint32_t> numbers;
  for (const Watched& one : watched_) numbers.push_back(one.probation.merge());
  return numbers;
}

void MergeWatch::setSides(uint32_t merge, MergeSides sides) {
  for (Watched& one : watched_)
    if (one.probation.merge() == merge) one.probation.setSides(std::move(sides));
}

void MergeWatch::follow(const KeyframeId& id, const KeyframeId& previous) {
  for (Watched& one : watched_) one.probation.follow(id, previous);
}

bool MergeWatch::inDoubt(const KeyframeId& a, const KeyframeId& b) const {
  Closure closure;
  closure.query = a;
  closure.candidate = b;
  return std::any_of(watched_.begin(), watched_.end(),
                     [&](const Watched& one) { return one.probation.between(closure); });
}

void MergeWatch::weigh(const Closure& closure, bool right) {
  Probation* weakest = nullptr;
  for (Watched& one : watched_) {
    if (!one.probation.between(closure)) continue;
    if (right)
      one.probation.support(closure);
    else if (weakest == nullptr || one.probation.supporters() <= weakest->supporters())
      weakest = &one.probation;
  }
  if (weakest != nullptr) weakest->oppose(closure);
}

Result<void> MergeWatch::hearFor(Watched& watched, const KeyframeId& id, const std::map<KeyframeId, Pose>& T_map_cam) {
  const auto own = watched.probation.sideOf(id);
  if (!own) return {};
  const auto placed = [&](const KeyframeId& one) -> Result<PlacedSketch> {
    const auto sketch = shelf_.sketch(one);
    if (!sketch) return sketch.error();
    return PlacedSketch{*sketch, T_map_cam.at(one)};
  };
  const auto witness = placed(id);
  if (!witness) return witness.error();
  std::vector<PlacedSketch> others;
  for (const auto& [other, side] : watched.probation.sides()) {
    if (side == *own) continue;
    auto sketch = placed(other);
    if (!sketch) return sketch.error();
    others.push_back(*sketch);
  }
  const auto testimony = hearing_.hear(*witness, others);
  if (!testimony) return testimony.error();
  watched.probation.hear(id, testimony->compared, testimony->evidence);
  return {};
}

Result<void> MergeWatch::hear(const KeyframeId& id, const std::map<KeyframeId, Pose>& T_map_cam) {
  for (Watched& one : watched_) {
    if (!one.probation.sideOf(id)) continue;
    for (; !one.unheard.empty() && !one.probation.passed(options_); one.unheard.pop_back())
      if (auto heard = hearFor(one, one.unheard.back(), T_map_cam); !heard) return heard;
    if (auto heard = hearFor(one, id, T_map_cam); !heard) return heard;
  }
  return {};
}

Result<std::vector<Objection>> MergeWatch::objections(const std::map<KeyframeId, Pose>& T_map_cam) {
  std::vector<Objection> found;
  for (Watched& one : watched_) {
    if (one.probation.viewsContradict(options_)) {
      std::map<KeyframeId, Evidence> anew;
      for (const auto& [witness, other] : one.probation.compared()) {
        const auto seen = hearing_.compare(witness, other, T_map_cam.at(witness).inverse() * T_map_cam.at(other));
        if (!seen) return seen.error();
        anew[witness].add(*seen);
      }
      one.probation.rehear(std::move(anew));
    }
    if (auto reason = one.probation.objection(T_map_cam, options_, vote_))
      found.push_back({one.probation.merge(), std::move(*reason)});
  }
  return found;
}

std::vector<Confirmation> MergeWatch::takeConfirmed() {
  std::vector<Confirmation> confirmed;
  std::erase_if(watched_, [&](const Watched& one) {
    const bool passed = one.probation.passed(options_);
    if (passed) confirmed.push_back(heardOf(one.probation));
    return passed;
  });
  return confirmed;
}

std::vector<Confirmation> MergeWatch::open() const {
  std::vector<Confirmation> heard;
  for (const Watched& one : watched_) heard.push_back(heardOf(one.probation));
  return heard;
}

}  // namespace comap
