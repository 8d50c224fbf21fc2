// Which keyframes a new one should be compared with: those that look alike, of other maps and of its own.
#pragma once

#include <functional>
#include <vector>

#include "mapping_core/ferns/place_index.h"
#include "protocol/types/keyframe.h"

namespace comap {

struct SearchOptions {
  size_t candidates = 3;            ///< per keyframe in other maps
  size_t loop_candidates = 2;       ///< per keyframe in its own map
  double max_dissimilarity = 0.45;  ///< of fern codes
  uint32_t loop_gap = 20;           ///< keyframes of one robot nearer in sequence are neighbours, not loops
};

/// How a keyframe relates to the one that asks.
enum class Kinship : uint8_t {
  kForeign,  ///< of another map, or of a part whose merge is in doubt
  kOwn,      ///< of the same map
};

struct Candidate {
  KeyframeId id;
  double dissimilarity = 1;
};

/// Thread rule: one thread.
class CandidateSearch {
 public:
  explicit CandidateSearch(const SearchOptions& options) : options_(options) {}

  /// False if the code's size or book differs from earlier ones.
  bool add(const KeyframeId& id, const FernCode& code);
  /// Candidates for `id`, which need not have been added: foreign ones first, each kind most similar first. `kinship`
  /// is asked of the most similar only.
  std::vector<Candidate> search(const KeyframeId& id, const FernCode& code,
                                const std::function<Kinship(const KeyframeId& other)>& kinship) const;

 private:
  SearchOptions options_;
  PlaceIndex places_;
  std::vector<KeyframeId> ids_;  // by place
};

}  // namespace comap
