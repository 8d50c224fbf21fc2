#include "mapping_core/verify/candidate_search.h"

#include <algorithm>

namespace comap {

bool CandidateSearch::add(const KeyframeId& id, const FernCode& code) {
  if (!places_.add(static_cast<uint32_t>(ids_.size()), code)) return false;
  ids_.push_back(id);
  codes_.emplace(id, code);
  return true;
}

std::vector<Candidate> CandidateSearch::search(const KeyframeId& id, const FernCode& code,
                                               const std::function<Kinship(const KeyframeId& other)>& kinship) const {
  const auto foreign = [&](uint32_t place) { return ids_[place] != id && kinship(ids_[place]) == Kinship::kForeign; };
  const auto loop = [&](uint32_t place) {
    const KeyframeId& other = ids_[place];
    const uint32_t apart = std::max(id.sequence, other.sequence) - std::min(id.sequence, other.sequence);
    const bool neighbour = other.robot == id.robot && other.session == id.session && apart < options_.loop_gap;
    return !neighbour && other != id && kinship(other) == Kinship::kOwn;
  };
  std::vector<Candidate> candidates;
  const auto collect = [&](size_t count, const std::function<bool(uint32_t)>& admit) {
    for (const PlaceCandidate& found : places_.query(code, count, admit, options_.max_dissimilarity))
      candidates.push_back({ids_[found.place], found.dissimilarity, false});
  };
  collect(options_.candidates, foreign);
  collect(options_.loop_candidates, loop);
  return candidates;
}

std::vector<Candidate> CandidateSearch::around(const FernCode& code, const Pose& T_map_cam,
                                               std::span<const std::pair<KeyframeId, Pose>> others,
                                               std::span<const Candidate> found) const {
  std::vector<std::pair<double, KeyframeId>> nearest;
  for (const auto& [id, T_map_other] : others) {
    const Pose between = T_map_other.inverse() * T_map_cam;
    const double distance = between.translation().norm() / options_.believed_m,
                 angle = between.angle() / options_.believed_rad;
    const bool known = std::any_of(found.begin(), found.end(), [&](const Candidate& one) { return one.id == id; });
    if (!known && distance < 1 && angle < 1) nearest.emplace_back(distance + angle, id);
  }
  std::sort(nearest.begin(), nearest.end());
  if (nearest.size() > options_.believed_candidates) nearest.resize(options_.believed_candidates);
  std::vector<Candidate> candidates;
  for (const auto& [score, id] : nearest) {
    const FernCode* other = this->code(id);
    candidates.push_back({id, other == nullptr ? 1 : dissimilarity(code, *other), true});
  }
  return candidates;
}

const FernCode* CandidateSearch::code(const KeyframeId& id) const {
  const auto found = codes_.find(id);
  return found == codes_.end() ? nullptr : &found->second;
}

}  // namespace comap
