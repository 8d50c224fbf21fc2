// What of a store that may be damaged is whole: looked at row by row, so that one damaged page hides no more than it
// holds.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "mapping_core/store/map_store.h"

namespace comap {

/// Of each kind the whole records, in the store's order; a record that names a keyframe that is not whole is not.
struct StoreSurvey {
  std::string path;
  std::map<std::string, std::string> meta;
  std::vector<StoredKeyframe> keyframes;  ///< an empty map: not mapped, or its pose is lost
  std::vector<WithdrawnEdge> edges;       ///< withdrawn_by 0: holds
  std::vector<MatchVerdict> verdicts;
  std::vector<MergeRecord> merges;
  std::map<uint32_t, uint32_t> undone_by;  ///< of merges that were undone
  size_t tiles = 0;
  size_t lost_keyframes = 0;  ///< as far as can be told

  std::vector<std::string> damage;   ///< a sentence each; empty: the store is whole
  std::vector<std::string> remarks;  ///< what is no damage, but worth knowing: gaps in the sequences
};

/// Reads only. kUnreachable or kBadData if the file is no store, or so damaged that nothing of it can be told.
/// `progress` (may be empty) hears (done, all) keyframes as their pictures are read, which is most of the work.
Result<StoreSurvey> surveyStore(const std::string& path, const std::function<void(size_t, size_t)>& progress = {});

/// Writes all that is whole into `to`, an empty store; poses and tiles are left to whoever computes the maps anew.
/// Odometry edges that are lost are taken from the keyframes themselves. Closures of a merge that is lost are left out:
/// their verdicts can join the maps again.
Result<void> saveWhole(const StoreSurvey& survey, MapStore& to);

}  // namespace comap
