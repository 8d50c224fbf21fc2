#include "mapping_core/verify/candidate_search.h"

namespace comap {

bool CandidateSearch::add(const KeyframeId& id, const FernCode& code) {
  if (!places_.add(static_cast<uint32_t>(ids_.size()), code)) return false;
  ids_.push_back(id);
  return true;
}

std::vector<Candidate> CandidateSearch::search(const KeyframeId& id, const FernCode& code,
                                               const std::function<Kinship(const KeyframeId& other)>& kinship) const {
  const auto foreign = [&](uint32_t place) { return ids_[place] != id && kinship(ids_[place]) == Kinship::kForeign; };
  const auto loop = [&](uint32_t place) {
    const KeyframeId& other = ids_[place];
    const bool neighbour =
        other.robot == id.robot && other.session == id.session && id.sequence - other.sequence < options_.loop_gap;
    return !neighbour && other != id && kinship(other) == Kinship::kOwn;
  };
  std::vector<Candidate> candidates;
  const auto collect = [&](size_t count, const std::function<bool(uint32_t)>& admit) {
    for (const PlaceCandidate& found : places_.query(code, count, admit, options_.max_dissimilarity))
      candidates.push_back({ids_[found.place], found.dissimilarity});
  };
  collect(options_.candidates, foreign);
  collect(options_.loop_candidates, loop);
  return candidates;
}

}  // namespace comap
