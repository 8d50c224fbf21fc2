#include "mapping_core/store/record_rows.h"

#include <array>

#include "mapping_core/store/packed_numbers.h"

namespace comap {
namespace {

constexpr std::array<const char*, kEdgeKinds> kKindNames = {"odometry", "loop", "inter_robot", "covisibility"};

PackedNumbers numbersOf(Query& query) {
  std::string wrong;
  const auto numbers = unpackNumbers(query.bytes(), wrong);
  if (!numbers) query.damaged(wrong);
  return numbers.value_or(PackedNumbers());
}

}  // namespace

Result<EdgeKind> kindOf(const std::string& name, const std::string& path) {
  for (size_t i = 0; i < kKindNames.size(); ++i) {
    if (name == kKindNames[i]) return static_cast<EdgeKind>(i);
  }
  return Error{ErrorCode::kBadData,
               path + ": edge kind is '" + name + "', expected odometry, loop, inter_robot or covisibility"};
}

std::string kindName(EdgeKind kind) { return kKindNames.at(size_t(kind)); }

Result<WithdrawnEdge> edgeOf(Query& query, const std::string& path) {
  const RowState state = query.rowState(COMAP_EDGE_TYPES);
  const int64_t number = query.integer();
  WithdrawnEdge one;
  const Result<EdgeKind> kind = kindOf(query.text(), path);
  if (!kind) return kind.error();
  one.edge.kind = *kind;
  one.edge.from = query.keyframeId();
  one.edge.to = query.keyframeId();
  const PackedNumbers numbers = numbersOf(query);
  one.edge.T_from_to = numbers.pose;
  one.edge.information = numbers.information;
  one.edge.merge = query.unsigned32();
  one.withdrawn_by = query.unsigned32();
  query.judged(state, "edge", number);
  return one;
}

MatchVerdict verdictOf(Query& query) {
  const RowState state = query.rowState(COMAP_VERDICT_TYPES);
  const int64_t number = query.integer();
  MatchVerdict v;
  v.query = query.keyframeId();
  v.candidate = query.keyframeId();
  v.accepted = query.integer() != 0;
  v.reason = query.text();
  for (double* value : {&v.fern_dissimilarity, &v.inlier_ratio, &v.rms_sigma, &v.degeneracy, &v.photometric_median,
                        &v.seen_through, &v.unlike, &v.features, &v.round_trip_m, &v.round_trip_rad}) {
    *value = query.real();
  }
  const PackedNumbers numbers = numbersOf(query);
  v.T_candidate_query = numbers.pose;
  v.information = numbers.information;
  query.judged(state, "verdict", number);
  return v;
}

MergeRecord mergeOf(Query& query) {
  MergeRecord merge;
  merge.number = query.unsigned32();
  merge.kept = query.text();
  merge.absorbed = query.text();
  merge.keyframes_ingested = query.unsigned32();
  merge.undone = query.text();
  merge.T_kept_absorbed = query.pose();
  query.checked("merge");
  return merge;
}

Result<void> readMergeLists(Database& database, MergeRecord& merge) {
  Result<Query> robots = database.query("SELECT robot, " COMAP_SOUND_OR(
      "merge", COMAP_MERGE_ROBOT_ROW) " FROM merge_robots WHERE merge = ? "
                                      "ORDER BY position");
  if (!robots) return robots.error();
  robots->bind(int64_t{merge.number});
  for (;;) {
    const Result<bool> row = robots->step();
    if (!row) return row.error();
    if (!*row) break;
    merge.robots.push_back(robots->text());
    robots->checked("a robot of merge");
  }
  Result<Query> voters = database.query("SELECT robot, session, sequence, " COMAP_SOUND_OR(
      "merge", COMAP_MERGE_VOTER_ROW) " FROM merge_voters "
                                      "WHERE merge = ? ORDER BY position");
  if (!voters) return voters.error();
  voters->bind(int64_t{merge.number});
  for (;;) {
    const Result<bool> row = voters->step();
    if (!row) return row.error();
    if (!*row) return {};
    merge.voters.push_back(voters->keyframeId());
    voters->checked("a voter of merge");
  }
}

}  // namespace comap
