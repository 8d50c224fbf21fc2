// Rows of edges, verdicts and merges: their columns in one order, and what they become. Inside this folder only.
#pragma once

#include <string>

#include "mapping_core/store/map_store.h"
#include "protocol/storage/database.h"

#define COMAP_POSE_COLUMNS "qx, qy, qz, qw, tx, ty, tz"
#define COMAP_INFORMATION_COLUMNS                                                              \
  "i00, i01, i02, i03, i04, i05, i10, i11, i12, i13, i14, i15, i20, i21, i22, i23, i24, i25, " \
  "i30, i31, i32, i33, i34, i35, i40, i41, i42, i43, i44, i45, i50, i51, i52, i53, i54, i55"
#define COMAP_TIE_COLUMNS "kind, from_robot, from_session, from_sequence, to_robot, to_session, to_sequence"
#define COMAP_EDGE_COLUMNS \
  COMAP_TIE_COLUMNS ", " COMAP_POSE_COLUMNS ", " COMAP_INFORMATION_COLUMNS ", merge, withdrawn_by"
#define COMAP_VERDICT_COLUMNS COMAP_JUDGED_COLUMNS ", " COMAP_INFORMATION_COLUMNS
#define COMAP_JUDGED_COLUMNS COMAP_JUDGEMENT_COLUMNS ", " COMAP_SCORE_COLUMNS ", " COMAP_POSE_COLUMNS
#define COMAP_JUDGEMENT_COLUMNS                                                                          \
  "query_robot, query_session, query_sequence, candidate_robot, candidate_session, candidate_sequence, " \
  "accepted, reason"
#define COMAP_SCORE_COLUMNS                                                                             \
  "fern_dissimilarity, inlier_ratio, rms_sigma, degeneracy, photometric_median, seen_through, unlike, " \
  "features, round_trip_m, round_trip_rad"
#define COMAP_MERGE_COLUMNS "number, kept, absorbed, keyframes_ingested, undone, " COMAP_POSE_COLUMNS

namespace comap {

std::string kindName(EdgeKind kind);
Result<EdgeKind> kindOf(const std::string& name, const std::string& path);

/// From a query that stands on a row of COMAP_EDGE_COLUMNS, and so on. What is wrong with a value comes out of the
/// query's next step(); an unknown kind is kBadData at once.
Result<WithdrawnEdge> edgeOf(Query& query, const std::string& path);
MatchVerdict verdictOf(Query& query);
/// Of a row without COMAP_INFORMATION_COLUMNS.
MatchVerdict verdictWithoutInformation(Query& query);
/// Without its lists.
MergeRecord mergeOf(Query& query);
/// Robots and voters of merge.number.
Result<void> readMergeLists(Database& database, MergeRecord& merge);

}  // namespace comap
