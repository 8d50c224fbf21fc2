// Merges, and the lists of each.
#include "mapping_core/store/map_store_state.h"
#include "mapping_core/store/record_rows.h"

namespace comap {
namespace {

// Statements of a merge's lists: ?1 the merge, ?2 the position.
Result<void> addMergeLists(Database& database, const MergeRecord& merge) {
  int64_t position = 0;
  for (const std::string& robot : merge.robots) {
    Result<Query> query = database.query("INSERT INTO merge_robots (merge, position, robot) VALUES (?, ?, ?)");
    if (!query) return query.error();
    if (Result<void> ran = query->bind(int64_t{merge.number}).bind(position++).bind(robot).run(); !ran) return ran;
  }
  position = 0;
  for (const KeyframeId& voter : merge.voters) {
    Result<Query> query =
        database.query("INSERT INTO merge_voters (merge, position, robot, session, sequence) VALUES (?, ?, ?, ?, ?)");
    if (!query) return query.error();
    if (Result<void> ran = query->bind(int64_t{merge.number}).bind(position++).bind(voter).run(); !ran) return ran;
  }
  return {};
}

}  // namespace

Result<void> MapStore::addMerge(const MergeRecord& merge) {
  Database& database = state_->database;
  Result<Transaction> transaction = Transaction::begin(database);
  if (!transaction) return transaction.error();
  // Written again after a restart: the record takes the place of the one with its number.
  Result<Query> remove = database.query("DELETE FROM merges WHERE number = ?");
  if (!remove) return remove.error();
  if (Result<void> ran = remove->bind(int64_t{merge.number}).run(); !ran) return ran;
  Result<Query> query =
      database.query("INSERT INTO merges (number, kept, absorbed, " COMAP_POSE_COLUMNS
                     ", keyframes_ingested, undone, undone_by) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  if (!query) return query.error();
  query->bind(int64_t{merge.number}).bind(merge.kept).bind(merge.absorbed).bind(merge.T_kept_absorbed);
  query->bind(int64_t{merge.keyframes_ingested})
      .bind(merge.undone)
      .bind(int64_t{merge.undone.empty() ? 0 : merge.number});
  if (Result<void> ran = query->run(); !ran) return ran;
  if (Result<void> added = addMergeLists(database, merge); !added) return added;
  return transaction->commit();
}

Result<std::vector<MergeRecord>> MapStore::merges() const {
  Result<Query> query = state_->database.query("SELECT " COMAP_MERGE_COLUMNS " FROM merges ORDER BY number");
  if (!query) return query.error();
  std::vector<MergeRecord> result;
  for (;;) {
    const Result<bool> row = query->step();
    if (!row) return row.error();
    if (!*row) return result;
    MergeRecord merge = mergeOf(*query);
    if (auto values = query->values(); !values) return values.error();
    if (Result<void> lists = readMergeLists(state_->database, merge); !lists) return lists.error();
    result.push_back(std::move(merge));
  }
}

Result<void> MapStore::undoMerge(uint32_t merge, const std::string& reason, uint32_t undone_by) {
  Database& database = state_->database;
  Result<Query> query = database.query("UPDATE merges SET undone = ?2, undone_by = ?3 WHERE number = ?1");
  if (!query) return query.error();
  query->bind(int64_t{merge}).bind(reason).bind(int64_t{reason.empty() ? 0 : undone_by});
  if (Result<void> ran = query->run(); !ran) return ran;
  if (database.changes() > 0) return {};
  return Error{ErrorCode::kWrongUse, database.path() + ": holds no merge " + std::to_string(merge)};
}

Result<std::vector<uint32_t>> MapStore::mergesUndoneBy(uint32_t merge) const {
  Result<Query> query = state_->database.query("SELECT number FROM merges WHERE undone_by = ? ORDER BY number");
  if (!query) return query.error();
  query->bind(int64_t{merge});
  std::vector<uint32_t> result;
  for (;;) {
    const Result<bool> row = query->step();
    if (!row) return row.error();
    if (!*row) return result;
    result.push_back(query->unsigned32());
  }
}

}  // namespace comap
