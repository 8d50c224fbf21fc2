// A merge in doubt: what the keyframes and closures that came after it say about it. States by evidence, not by time.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "mapping_core/graph/closure.h"
#include "mapping_core/verify/merge_check.h"
#include "mapping_core/verify/vote.h"

namespace comap {

struct ProbationOptions {
  /// Keyframes of either side that must have seen what the other side saw, and not have contradicted it.
  size_t witnesses = 40;
  size_t views = 8;         ///< of the other side that one witness is compared with, the most overlapping
  size_t fewest_views = 6;  ///< below it nothing is concluded from views
  /// Share of contradictions beyond which a merge comes apart; what the merge check has.
  double contradicted = 0.006;
  /// What is different in two places that look alike may be in view of few keyframes only, and drown in what the others
  /// see. A witness contradicts if more of what it sees does than this: of right merges, off by 3 cm, at most 0.018
  /// does. So many such witnesses, in number and as share of all, part the maps.
  double witness_contradicted = 0.02;
  size_t contradicting_witnesses = 3;
  double contradicting_share = 0.2;
  /// A contradiction that such a shift of the two views explains is the drift of a right merge.
  double drift_m = 0.10, drift_rad = 0.0873;
};

/// Which of the two maps a keyframe is of. Keyframes of neither are not there.
using MergeSides = std::map<KeyframeId, bool>;

/// Two keyframes that were compared, the witness first.
using ComparedViews = std::pair<KeyframeId, KeyframeId>;

/// Thread rule: one thread.
class Probation {
 public:
  /// `voters`: the closures that made the merge, which count as its supporters.
  Probation(uint32_t merge, MergeSides sides, const std::vector<Closure>& voters);

  uint32_t merge() const { return merge_; }
  /// The keyframe is of the side of `previous`, if that is of any.
  void follow(const KeyframeId& id, const KeyframeId& previous);
  /// The sides are others now, since another merge was made or undone.
  void setSides(MergeSides sides) { sides_ = std::move(sides); }
  const MergeSides& sides() const { return sides_; }
  std::optional<bool> sideOf(const KeyframeId& id) const;
  /// Whether the closure joins the two sides.
  bool between(const Closure& closure) const;

  /// A keyframe was compared with views of the other side. Evidence of no views leaves no trace.
  void hear(const KeyframeId& witness, const std::vector<ComparedViews>& compared, const Evidence& evidence);
  /// All that was compared, compared anew, by witness.
  void rehear(std::map<KeyframeId, Evidence> heard) { heard_ = std::move(heard); }
  const std::vector<ComparedViews>& compared() const { return compared_; }

  /// A closure between the sides that the map agrees with.
  void support(const Closure& closure) { supporters_.push_back(closure); }
  /// A closure between the sides, accepted by its own gates, that the map cannot agree with.
  void oppose(const Closure& closure) { opponents_.push_back(closure); }
  size_t supporters() const { return countIndependent(supporters_); }
  const std::vector<Closure>& opponents() const { return opponents_; }

  /// Why the merge cannot stand; nothing as long as it can. Views contradict beyond the limit; or closures do that
  /// agree with each other, enough for a merge of their own, and that are no fewer than the supporters. `T_map_cam`:
  /// current poses.
  std::optional<std::string> objection(const std::map<KeyframeId, Pose>& T_map_cam, const ProbationOptions& options,
                                       const VoteOptions& vote) const;
  /// Whether views alone speak against it: all of them together, or those of some witnesses.
  bool viewsContradict(const ProbationOptions& options) const;
  /// Enough keyframes have confirmed it. Ask for an objection first.
  bool passed(const ProbationOptions& options) const { return heard_.size() >= options.witnesses; }
  size_t witnesses() const { return heard_.size(); }
  Evidence evidence() const;  ///< of all witnesses

 private:
  size_t contradictingWitnesses(const ProbationOptions& options) const;
  bool manyContradict(const ProbationOptions& options) const;
  static size_t countIndependent(const std::vector<Closure>& closures);

  uint32_t merge_ = 0;
  MergeSides sides_;
  std::vector<Closure> supporters_, opponents_;
  std::map<KeyframeId, Evidence> heard_;  // by witness
  std::vector<ComparedViews> compared_;
};

}  // namespace comap
