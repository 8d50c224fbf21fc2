// What of a store that may be damaged is whole: looked at row by row, so that one damaged page hides no more than it
// holds.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "mapping_core/store/kept_rows.h"
#include "mapping_core/store/map_store.h"
#include "protocol/storage/leaf_rows.h"

namespace comap {

/// A keyframe whose message is whole.
struct WholeKeyframe {
  StoredKeyframe stored;              ///< an empty map: not mapped, or its pose is lost
  bool described = true;              ///< false: its row is lost or says something else than its message
  bool linked = false, tied = false;  ///< its message ties it to `linked_to`; an odometry edge ties it to one before
  uint32_t linked_to = 0;
  bool has_edge = false;
};

/// Of each kind which records are whole; a record that names a keyframe that is not whole is not.
struct StoreSurvey {
  std::string path;
  std::map<std::string, std::string> meta;
  std::vector<WholeKeyframe> keyframes;                                 ///< in the store's order
  KeptRows descriptions, messages, poses, edges, verdicts, merge_rows;  ///< `descriptions`: that messages agree with
  std::map<int64_t, LeafRow> strays;  ///< where messages are that no page leads to, by arrival; in none of `messages`
  std::vector<MergeRecord> merges;
  size_t tiles = 0;
  size_t lost_keyframes = 0;  ///< as far as can be told

  /// Whether the indexes of these tables are what the tables say.
  bool keyframe_indexes_whole = false, edge_indexes_whole = false, verdict_indexes_whole = false;
  std::vector<std::string> damage;   ///< a sentence each; empty: the store is whole
  std::vector<std::string> remarks;  ///< what is no damage, but worth knowing, such as gaps in the sequences
};

/// What to say of a file whose end is missing; empty if it is there.
std::string cutOffText(const std::string& path);

enum class SurveyDepth {
  kRows,   ///< every row, and each index of a large table against its rows, side by side: all that saveWhole() needs.
           ///< Only of a store that nobody writes
  kPages,  ///< and what SQLite's own check finds, that no row need suffer from; it takes about as long
};

/// Reads only, all as it was at one moment, though a core may write meanwhile. kUnreachable or kBadData if the file is
/// no store, or so damaged that nothing of it can be told. `progress` (may be empty) hears (done, all) keyframes as
/// their pictures are read, which is most of the work.
Result<StoreSurvey> surveyStore(const std::string& path, const std::function<void(size_t, size_t)>& progress = {},
                                SurveyDepth depth = SurveyDepth::kPages);

/// Makes a store at `path` of all that is in the one at `damaged`, which nobody writes, whether it is whole or not: by
/// SQLite, entry by entry as they lie in the file. Meant to run beside surveyStore(). Returns false, and leaves
/// nothing, where damage or anything else is in its way.
bool copyUnseen(const std::string& damaged, const std::string& path);

/// Writes all that is whole into a new store at `path`, and nothing that is there is looked at; tiles are left to
/// whoever computes the maps anew. `copied`: copyUnseen() has made a store there; of it, tables that are whole stay.
/// Odometry edges that are lost are taken from the keyframes themselves; across a keyframe that is not there, from the
/// poses of those around it, if they stood in one map and odometry agrees. Closures of a merge that is lost are left
/// out: their verdicts can join the maps again. What fails or is interrupted leaves half a store, so that it should get
/// its name afterwards.
Result<void> saveWhole(const StoreSurvey& survey, const std::string& path, bool copied = false);

}  // namespace comap
