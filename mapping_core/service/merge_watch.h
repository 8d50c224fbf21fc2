// The merges on probation: what each new keyframe says about them, and which of them can no longer stand.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "mapping_core/verify/probation.h"
#include "mapping_core/verify/witness.h"
#include "protocol/types/messages.h"

namespace comap {

struct Objection {
  uint32_t merge = 0;
  std::string reason;
};

/// What has been heard of a merge.
struct Confirmation {
  uint32_t merge = 0;
  size_t witnesses = 0, supporters = 0;
  double contradicted = 0;
};

/// Thread rule: one thread.
class MergeWatch {
 public:
  MergeWatch(KeyframeShelf& shelf, const MergeCheckOptions& check, const CovisibilityOptions& tie,
             const ProbationOptions& options, const VoteOptions& vote)
      : shelf_(shelf), options_(options), vote_(vote), hearing_(shelf, check, tie, options) {}

  /// A merge was made. `unheard`: keyframes that came after it and whose testimony is still to be taken.
  void open(Probation probation, std::vector<KeyframeId> unheard = {});
  /// The merge is no longer watched, if it was.
  void close(uint32_t merge);
  std::vector<uint32_t> merges() const;
  void setSides(uint32_t merge, MergeSides sides);

  /// A keyframe came that is linked to another: it is of the same sides.
  void follow(const KeyframeId& id, const KeyframeId& previous);
  /// Whether two keyframes of one map are on different sides of a merge on probation.
  bool inDoubt(const KeyframeId& a, const KeyframeId& b) const;
  /// Notes a closure between two keyframes of one map: right as the map has it, or opposed to it. It is charged to that
  /// merge between its ends that has the fewest supporters.
  void weigh(const Closure& closure, bool right);

  /// Takes the testimony of the keyframe `id`, and of those unheard, for all merges of its map. `T_map_cam` has the
  /// poses of all keyframes. Errors are the shelf's.
  Result<void> hear(const KeyframeId& id, const std::map<KeyframeId, Pose>& T_map_cam);
  /// Merges that cannot stand. Those that views speak against are heard once more at the current poses.
  Result<std::vector<Objection>> objections(const std::map<KeyframeId, Pose>& T_map_cam);
  /// Takes out the merges that have been confirmed by enough.
  std::vector<Confirmation> takeConfirmed();
  /// Of those that are still on probation.
  std::vector<Confirmation> open() const;

 private:
  struct Watched {
    Probation probation;
    std::vector<KeyframeId> unheard;
  };
  Result<void> hearFor(Watched& watched, const KeyframeId& id, const std::map<KeyframeId, Pose>& T_map_cam);

  KeyframeShelf& shelf_;
  ProbationOptions options_;
  VoteOptions vote_;
  WitnessHearing hearing_;
  std::vector<Watched> watched_;  // in order of their making
};

/// Sides as sidesOf gives them.
MergeSides mergeSides(std::span<const KeyframeId> first, std::span<const KeyframeId> second);

}  // namespace comap
