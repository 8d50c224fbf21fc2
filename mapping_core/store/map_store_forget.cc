// Taking a robot out of the store, and out of its file.
#include <algorithm>

#include "mapping_core/store/map_store_state.h"
#include "mapping_core/store/merge_again.h"

namespace comap {
namespace {

Result<void> runWith(Database& database, const char* sql, const std::string& robot) {
  Result<Query> query = database.query(sql);
  if (!query) return query.error();
  return query->bind(robot).run();
}

// ?1 the robot. Merges before edges, and lists after merges: each looks at what is still there.
constexpr const char* kRemovals[] = {
    "DELETE FROM edges WHERE merge <> 0 AND merge IN (SELECT number FROM merges JOIN merge_robots ON merge = number "
    "WHERE undone = '' AND robot = ?1)",
    "DELETE FROM merges WHERE undone = '' AND number IN (SELECT merge FROM merge_robots WHERE robot = ?1)",
    // In the order of the file: robots map by turns, so that nearly each page has one of its edges.
    "DELETE FROM edges WHERE from_robot = ?1 OR to_robot = ?1",
    "DELETE FROM verdicts WHERE query_robot = ?1 OR candidate_robot = ?1",
    "DELETE FROM merges WHERE undone <> '' AND number IN (SELECT merge FROM merge_robots WHERE robot = ?1) "
    "AND NOT EXISTS (SELECT 1 FROM edges WHERE merge = merges.number AND merge <> 0)",
    "DELETE FROM merge_robots WHERE robot = ?1",
    "DELETE FROM merge_voters WHERE robot = ?1",
    // Its surfels are among those of its maps.
    "DELETE FROM tiles WHERE map IN (SELECT DISTINCT map FROM poses JOIN keyframes ON keyframe = arrival "
    "WHERE robot = ?1)",
    "DELETE FROM keyframes WHERE robot = ?1",
    "DELETE FROM meta WHERE key = 'robot_present_' || ?1",
    // The contributor bits of the others close up, in their order.
    "UPDATE robots SET bit = -bit - 1 WHERE bit > (SELECT bit FROM robots WHERE name = ?1)",
    "DELETE FROM robots WHERE name = ?1",
    "UPDATE robots SET bit = -bit - 2 WHERE bit < 0 AND ?1 = ?1",
};

Result<size_t> countKeyframes(Database& database, const std::string& robot) {
  Result<Query> count = database.query("SELECT count(*) FROM keyframes WHERE robot = ?");
  if (!count) return count.error();
  const Result<bool> row = count->bind(robot).step();
  if (!row) return row.error();
  return static_cast<size_t>(count->integer());
}

// Of each mapped keyframe, in order of arrival, how many of the others' were mapped before it; and of all together.
Result<std::vector<size_t>> othersBefore(Database& database, const std::string& robot) {
  Result<Query> query =
      database.query("SELECT robot <> ? FROM keyframes JOIN poses ON keyframe = arrival ORDER BY arrival");
  if (!query) return query.error();
  query->bind(robot);
  std::vector<size_t> counts = {0};
  for (;;) {
    const Result<bool> row = query->step();
    if (!row) return row.error();
    if (!*row) return counts;
    counts.push_back(counts.back() + static_cast<size_t>(query->integer()));
  }
}

// Merges say when they were made by how many keyframes were mapped; of these some are gone.
Result<void> countAnew(MapStore& store, Database& database, const std::vector<size_t>& others) {
  const auto left = [&](size_t count) { return others[std::min(count, others.size() - 1)]; };
  const auto merges = store.merges();
  if (!merges) return merges.error();
  for (const MergeRecord& merge : *merges) {
    Result<Query> query = database.query("UPDATE merges SET keyframes_ingested = ?2 WHERE number = ?1");
    if (!query) return query.error();
    query->bind(int64_t{merge.number}).bind(static_cast<int64_t>(left(merge.keyframes_ingested)));
    if (Result<void> ran = query->run(); !ran) return ran;
    const auto again = store.givenAgain(merge.number);
    if (!again) return again.error();
    if (!*again) continue;
    if (Result<void> set = store.setGivenAgain(merge.number, left(**again)); !set) return set;
  }
  return {};
}

}  // namespace

Result<void> MapStore::checkRobot(const std::string& robot) const {
  const auto known = robots();
  if (!known) return known.error();
  if (std::find(known->begin(), known->end(), robot) != known->end()) return {};
  std::string names;
  for (const std::string& name : *known) names += (names.empty() ? "" : ", ") + name;
  return Error{ErrorCode::kWrongUse, "holds no robot '" + robot + "', but " + (names.empty() ? "none" : names)};
}

Result<size_t> MapStore::removeRobot(const std::string& robot) {
  Database& database = state_->database;
  if (auto known = checkRobot(robot); !known) return known.error();
  const auto removed = countKeyframes(database, robot);
  if (!removed) return removed;
  // What is deleted is overwritten with zeros.
  if (Result<void> set = database.execute("PRAGMA secure_delete = ON"); !set) return set.error();
  Result<Transaction> transaction = Transaction::begin(database);
  if (!transaction) return transaction.error();
  if (Result<void> set = setMeta("complete", "no"); !set) return set.error();
  if (Result<void> set = setMeta("compact_due", "yes"); !set) return set.error();
  if (Result<void> set = setVotesWait(true); !set) return set.error();
  const auto others = othersBefore(database, robot);
  if (!others) return others.error();
  for (const char* sql : kRemovals)
    if (Result<void> ran = runWith(database, sql, robot); !ran) return ran.error();
  if (Result<void> dropped = dropAgainOfNone(database); !dropped) return dropped.error();
  if (Result<void> counted = countAnew(*this, database, *others); !counted) return counted.error();
  if (Result<void> committed = transaction->commit(); !committed) return committed.error();
  return removed;
}

Result<bool> MapStore::compactDue() const {
  const auto due = meta("compact_due");
  if (!due) return due.error();
  return *due == "yes";
}

Result<void> MapStore::compact() {
  Database& database = state_->database;
  if (Result<void> written = database.execute("VACUUM"); !written) return written;
  // Until the log is in the file, the file's pages are the old ones.
  if (Result<void> set = database.execute("PRAGMA busy_timeout = 1000"); !set) return set;
  const auto busy = database.integer("PRAGMA wal_checkpoint(TRUNCATE)");
  database.waitForOthers();
  if (!busy) return busy.error();
  if (*busy != 0)
    return Error{ErrorCode::kUnreachable, database.path() + ": another program reads it, so that its old pages stay"};
  return database.execute("DELETE FROM meta WHERE key = 'compact_due'");
}

}  // namespace comap
