// Which keyframes a new one should be compared with: those that look alike, of other maps and of its own.
#pragma once

#include <functional>
#include <map>
#include <span>
#include <vector>

#include "mapping_core/ferns/place_index.h"
#include "protocol/types/keyframe.h"
#include "protocol/types/pose.h"

namespace comap {

struct SearchOptions {
  size_t candidates = 3;                        ///< per keyframe in other maps
  size_t loop_candidates = 2;                   ///< per keyframe in its own map
  double max_dissimilarity = 0.45;              ///< of fern codes
  size_t believed_candidates = 2;               ///< per keyframe that says where it believes to be in another map
  double believed_m = 1.0, believed_rad = 0.6;  ///< those stand no farther from there
  uint32_t loop_gap = 20;                       ///< keyframes of one robot nearer in sequence are neighbours, not loops
};

/// How a keyframe relates to the one that asks.
enum class Kinship : uint8_t {
  kForeign,  ///< of another map, or of a part whose merge is in doubt
  kOwn,      ///< of the same map
  kNone,     ///< is not to be asked
};

struct Candidate {
  KeyframeId id;
  double dissimilarity = 1;
  bool believed = false;  ///< the robot itself says that it is there
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

  /// Of `others` (which stand at these poses in one map) those that stand nearest to T_map_cam, nearest first: where
  /// a robot believes to be. None that search() found already (`found`).
  std::vector<Candidate> around(const FernCode& code, const Pose& T_map_cam,
                                std::span<const std::pair<KeyframeId, Pose>> others,
                                std::span<const Candidate> found) const;

  /// The code of a keyframe that was added; null if it was not.
  const FernCode* code(const KeyframeId& id) const;

 private:
  SearchOptions options_;
  PlaceIndex places_;
  std::vector<KeyframeId> ids_;  // by place
  std::map<KeyframeId, FernCode> codes_;
};

}  // namespace comap
