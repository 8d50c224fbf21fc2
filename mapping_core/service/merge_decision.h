// What taking a merge back, or giving it again, changes of the records: no picture and no device is needed, so that the
// decision itself takes a second or two in a store of any size. The maps follow from the records.
#pragma once

#include <set>
#include <span>
#include <string>
#include <vector>

#include "mapping_core/store/map_store.h"

namespace comap {

struct MergeDecision {
  std::vector<MergeRecord> merges;  ///< that are undone now, or hold again; the one that was named first
  std::set<KeyframeId> changed;     ///< anchors, as they are now, of the maps that are not what they were
};

/// Whether there is such a merge, and it is not undone yet; or it is, and not with another. kWrongUse, with the reason,
/// if not: of the decisions below these can be refused by looking alone.
Result<MergeRecord> checkSplit(const MapStore& store, uint32_t merge, const std::string& reason);
Result<MergeRecord> checkRejoin(const MapStore& store, uint32_t merge);

/// Takes `merge` back: its closures are withdrawn, and with them every edge that ties what it had tied, and merges too
/// few of whose closures are left. `keyframes`: all that are mapped, in order of arrival. Call within a transaction.
/// kWrongUse if there is no such merge, it is undone already, or `reason` is empty.
Result<MergeDecision> decideSplit(MapStore& store, std::span<const KeyframeId> keyframes, uint32_t merge,
                                  const std::string& reason, size_t votes_needed);

/// Takes a split back. Call within a transaction. kWrongUse if the merge is not undone, was undone with another, or its
/// maps were joined otherwise since.
Result<MergeDecision> decideRejoin(MapStore& store, std::span<const KeyframeId> keyframes, uint32_t merge,
                                   size_t votes_needed);

/// How many keyframes were mapped when the merge was made or, if it was taken back and given again, when that was: what
/// came since judges it.
Result<size_t> doubtedSince(const MapStore& store, const MergeRecord& merge);

}  // namespace comap
