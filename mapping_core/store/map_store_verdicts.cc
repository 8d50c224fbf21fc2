// Verdicts.
#include "mapping_core/store/map_store_state.h"
#include "mapping_core/store/packed_numbers.h"
#include "mapping_core/store/record_rows.h"

namespace comap {

Result<void> MapStore::addVerdict(const MatchVerdict& v) {
  Result<Query> query =
      state_->database.query("INSERT INTO verdicts (" COMAP_JUDGEMENT_COLUMNS ", " COMAP_SCORE_COLUMNS
                             ", numbers) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  if (!query) return query.error();
  query->bind(v.query).bind(v.candidate).bind(int64_t{v.accepted}).bind(v.reason);
  for (const double value : {v.fern_dissimilarity, v.inlier_ratio, v.rms_sigma, v.degeneracy, v.photometric_median,
                             v.seen_through, v.unlike, v.features, v.round_trip_m, v.round_trip_rad}) {
    query->bind(value);
  }
  const std::vector<uint8_t> numbers = packNumbers(v.T_candidate_query, v.information);
  return query->bind(numbers).run();
}

Result<void> MapStore::eachVerdict(const VerdictFilter& filter,
                                   const std::function<void(MatchVerdict&& verdict)>& take) const {
  // Between ?1 and ?2 lies `accepted`; of one reason, SQLite then finds the rows by the index.
#define COMAP_FROM_VERDICTS                                      \
  " FROM verdicts WHERE accepted BETWEEN ?1 AND ?2 AND ?3 = '' " \
  "AND (?4 = '' OR query_robot = ?4 OR candidate_robot = ?4) ORDER BY number"
#define COMAP_FROM_VERDICTS_OF_REASON                                                       \
  " FROM verdicts WHERE accepted BETWEEN ?1 AND ?2 AND accepted IN (0, 1) AND reason = ?3 " \
  "AND (?4 = '' OR query_robot = ?4 OR candidate_robot = ?4) ORDER BY number"
  Result<Query> query =
      state_->database.query(filter.reason.empty() ? "SELECT " COMAP_VERDICT_COLUMNS COMAP_FROM_VERDICTS
                                                   : "SELECT " COMAP_VERDICT_COLUMNS COMAP_FROM_VERDICTS_OF_REASON);
  if (!query) return query.error();
  const int64_t first = filter.accepted.value_or(false) ? 1 : 0, last = filter.accepted.value_or(true) ? 1 : 0;
  query->bind(first).bind(last).bind(filter.reason).bind(filter.robot);
  for (;;) {
    const Result<bool> row = query->step();
    if (!row) return row.error();
    if (!*row) return {};
    MatchVerdict verdict = verdictOf(*query);
    if (auto values = query->values(); !values) return values;
    take(std::move(verdict));
  }
}

Result<std::vector<MatchVerdict>> MapStore::verdicts(const VerdictFilter& filter) const {
  std::vector<MatchVerdict> result;
  const auto all = eachVerdict(filter, [&](MatchVerdict&& verdict) { result.push_back(std::move(verdict)); });
  if (!all) return all.error();
  return result;
}

Result<std::map<std::string, size_t>> MapStore::verdictCounts(const std::string& robot) const {
  Result<Query> query = state_->database.query(
      robot.empty() ? "SELECT reason, count(*) FROM verdicts WHERE ?1 = '' GROUP BY accepted, reason"
                    : "SELECT reason, count(*) FROM verdicts WHERE query_robot = ?1 OR candidate_robot = ?1 "
                      "GROUP BY accepted, reason");
  if (!query) return query.error();
  query->bind(robot);
  std::map<std::string, size_t> result;
  for (;;) {
    const Result<bool> row = query->step();
    if (!row) return row.error();
    if (!*row) return result;
    const std::string reason = query->text();
    result[reason] += static_cast<size_t>(query->integer());
  }
}

}  // namespace comap
