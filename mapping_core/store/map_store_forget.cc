// Taking a robot out of the store.
#include <algorithm>

#include "mapping_core/store/map_store_state.h"

namespace comap {
namespace {

Result<void> runWith(Database& database, const char* sql, const std::string& robot) {
  Result<Query> query = database.query(sql);
  if (!query) return query.error();
  return query->bind(robot).run();
}

// ?1 the robot. Merges before edges, and lists after merges: each looks at what is still there.
constexpr const char* kRemovals[] = {
    "DELETE FROM edges WHERE merge IN (SELECT number FROM merges JOIN merge_robots ON merge = number "
    "WHERE undone = '' AND robot = ?1)",
    "DELETE FROM merges WHERE undone = '' AND number IN (SELECT merge FROM merge_robots WHERE robot = ?1)",
    "DELETE FROM edges WHERE from_robot = ?1 OR to_robot = ?1",
    "DELETE FROM verdicts WHERE query_robot = ?1 OR candidate_robot = ?1",
    "DELETE FROM merges WHERE undone <> '' AND number IN (SELECT merge FROM merge_robots WHERE robot = ?1) "
    "AND NOT EXISTS (SELECT 1 FROM edges WHERE merge = number)",
    "DELETE FROM merge_robots WHERE robot = ?1",
    "DELETE FROM merge_voters WHERE robot = ?1",
    "DELETE FROM keyframes WHERE robot = ?1",
    // The contributor bits of the others close up, in their order.
    "UPDATE robots SET bit = -bit - 1 WHERE bit > (SELECT bit FROM robots WHERE name = ?1)",
    "DELETE FROM robots WHERE name = ?1",
    "UPDATE robots SET bit = -bit - 2 WHERE bit < 0 AND ?1 = ?1",
};

}  // namespace

Result<size_t> MapStore::removeRobot(const std::string& robot) {
  Database& database = state_->database;
  const auto known = robots();
  if (!known) return known.error();
  if (std::find(known->begin(), known->end(), robot) == known->end()) {
    std::string names;
    for (const std::string& name : *known) names += (names.empty() ? "" : ", ") + name;
    return Error{ErrorCode::kWrongUse, "holds no robot '" + robot + "', but " + (names.empty() ? "none" : names)};
  }
  size_t keyframes_of_robot = 0;
  {
    Result<Query> count = database.query("SELECT count(*) FROM keyframes WHERE robot = ?");
    if (!count) return count.error();
    const Result<bool> row = count->bind(robot).step();
    if (!row) return row.error();
    keyframes_of_robot = static_cast<size_t>(count->integer());
  }
  Result<Transaction> transaction = Transaction::begin(database);
  if (!transaction) return transaction.error();
  if (Result<void> set = setMeta("complete", "no"); !set) return set.error();
  if (Result<void> set = setVotesWait(true); !set) return set.error();
  for (const char* sql : kRemovals)
    if (Result<void> ran = runWith(database, sql, robot); !ran) return ran.error();
  if (Result<void> committed = transaction->commit(); !committed) return committed.error();
  return keyframes_of_robot;
}

Result<void> MapStore::compact() { return state_->database.execute("VACUUM"); }

}  // namespace comap
