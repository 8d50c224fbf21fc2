// Rows of edges, verdicts and merges: their columns in one order, and what they become. Inside this folder only.
#pragma once

#include <string>

#include "mapping_core/store/map_store.h"
#include "mapping_core/store/table_rows.h"
#include "protocol/storage/database.h"

/// The last column is the row's checksum, or tells whether the row fits it.
#define COMAP_EDGE_COLUMNS COMAP_EDGE_ROW ", checksum"
#define COMAP_VERDICT_COLUMNS COMAP_VERDICT_ROW ", checksum"
#define COMAP_MERGE_COLUMNS                                                 \
  "number, kept, absorbed, keyframes_ingested, undone, " COMAP_POSE_COLUMNS \
  ", " COMAP_SOUND_OR("number", COMAP_MERGE_ROW)

namespace comap {

std::string kindName(EdgeKind kind);
Result<EdgeKind> kindOf(const std::string& name, const std::string& path);

/// From a query that stands on a row of COMAP_EDGE_COLUMNS, and so on. What is wrong with a value comes out of the
/// query's next step(), a checksum that does not fit among it; an unknown kind is kBadData at once.
Result<WithdrawnEdge> edgeOf(Query& query, const std::string& path);
MatchVerdict verdictOf(Query& query);
/// Without its lists.
MergeRecord mergeOf(Query& query);
/// Robots and voters of merge.number.
Result<void> readMergeLists(Database& database, MergeRecord& merge);

}  // namespace comap
