// The columns of each table in one order, as its checksum takes them, and whether a row fits its checksum. Inside this
// folder only.
#pragma once

#define COMAP_POSE_COLUMNS "qx, qy, qz, qw, tx, ty, tz"
#define COMAP_TIE_COLUMNS "kind, from_robot, from_session, from_sequence, to_robot, to_session, to_sequence"
#define COMAP_JUDGEMENT_COLUMNS                                                                          \
  "query_robot, query_session, query_sequence, candidate_robot, candidate_session, candidate_sequence, " \
  "accepted, reason"
#define COMAP_SCORE_COLUMNS                                                                             \
  "fern_dissimilarity, inlier_ratio, rms_sigma, degeneracy, photometric_median, seen_through, unlike, " \
  "features, round_trip_m, round_trip_rad"

// Without the pictures of a keyframe and the surfels of a tile, which have checksums of their own.
#define COMAP_META_ROW "key, value"
#define COMAP_ROBOT_ROW "bit, name"
#define COMAP_KEYFRAME_ROW "arrival, robot, session, sequence, stamp_ns, bytes, crc32"
#define COMAP_POSE_ROW "keyframe, map, " COMAP_POSE_COLUMNS
#define COMAP_EDGE_ROW "number, " COMAP_TIE_COLUMNS ", numbers, merge, withdrawn_by"
#define COMAP_VERDICT_ROW "number, " COMAP_JUDGEMENT_COLUMNS ", " COMAP_SCORE_COLUMNS ", numbers"
#define COMAP_MERGE_ROW "number, kept, absorbed, " COMAP_POSE_COLUMNS ", keyframes_ingested, undone, undone_by"
#define COMAP_MERGE_ROBOT_ROW "merge, position, robot"
#define COMAP_MERGE_VOTER_ROW "merge, position, robot, session, sequence"
#define COMAP_TILE_ROW "number, map, x, y, z, revision, surfels"

// The types of those columns, as Query::rowState() takes them.
#define COMAP_KEYFRAME_TYPES "itiiiii"
#define COMAP_POSE_TYPES "itrrrrrrr"
#define COMAP_EDGE_TYPES "ittiitiibii"
#define COMAP_VERDICT_TYPES "itiitiiitrrrrrrrrrrb"

/// 1 if the row is as it was written, else 0 or NULL.
#define COMAP_IS_SOUND(row) "checksum = row_sum(" row ")"
/// For Query::checked().
#define COMAP_SOUND_OR(number, row) "iif(checksum = row_sum(" row "), -1, " number ")"
