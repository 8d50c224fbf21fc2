// Edges.
#include <algorithm>
#include <numeric>

#include "mapping_core/store/map_store_state.h"
#include "mapping_core/store/packed_numbers.h"
#include "mapping_core/store/record_rows.h"

namespace comap {
namespace {

Result<std::vector<WithdrawnEdge>> readEdges(Database& database, const char* sql) {
  Result<Query> query = database.query(sql);
  if (!query) return query.error();
  std::vector<WithdrawnEdge> result;
  for (;;) {
    const Result<bool> row = query->step();
    if (!row) return row.error();
    if (!*row) return result;
    Result<WithdrawnEdge> one = edgeOf(*query, database.path());
    if (!one) return one.error();
    result.push_back(std::move(*one));
  }
}

#define COMAP_EDGE_ENDS "kind, from_robot, from_session, from_sequence, to_robot, to_session, to_sequence, merge"

// From a query whose rows are COMAP_EDGE_ENDS, and then their numbers if `numbers` is given; only those that are
// wanted.
Result<std::vector<Edge>> readEnds(Query& query, const std::string& path,
                                   const std::function<bool(const Edge&)>& wanted,
                                   std::vector<int64_t>* numbers = nullptr) {
  std::vector<Edge> result;
  for (;;) {
    const Result<bool> row = query.step();
    if (!row) return row.error();
    if (!*row) return result;
    const auto kind = kindOf(query.text(), path);
    if (!kind) return kind.error();
    Edge edge;
    edge.kind = *kind;
    edge.from = query.keyframeId();
    edge.to = query.keyframeId();
    edge.merge = query.unsigned32();
    if (!wanted(edge)) continue;
    if (numbers != nullptr) numbers->push_back(query.integer());
    result.push_back(std::move(edge));
  }
}

Result<std::vector<Edge>> readEnds(Database& database, const char* sql, const std::function<bool(const Edge&)>& wanted,
                                   std::vector<int64_t>* numbers = nullptr) {
  Result<Query> query = database.query(sql);
  if (!query) return query.error();
  return readEnds(*query, database.path(), wanted, numbers);
}

// Of a statement whose rows are (kind, count).
Result<std::array<size_t, kEdgeKinds>> countKinds(Database& database, const char* sql) {
  Result<Query> query = database.query(sql);
  if (!query) return query.error();
  std::array<size_t, kEdgeKinds> counts{};
  for (;;) {
    const Result<bool> row = query->step();
    if (!row) return row.error();
    if (!*row) return counts;
    const auto kind = kindOf(query->text(), database.path());
    if (!kind) return kind.error();
    counts[static_cast<size_t>(*kind)] = static_cast<size_t>(query->integer());
  }
}

}  // namespace

Result<void> MapStore::addEdge(const Edge& edge) {
  // A later estimate of the same tie replaces the earlier one, in its place.
  Result<Query> query = state_->database.query("INSERT INTO edges (" COMAP_TIE_COLUMNS
                                               ", numbers, merge, withdrawn_by) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, 0) "
                                               "ON CONFLICT (" COMAP_TIE_COLUMNS
                                               ") DO UPDATE SET numbers = excluded.numbers, merge = excluded.merge, "
                                               "withdrawn_by = 0");
  if (!query) return query.error();
  const std::vector<uint8_t> numbers = packNumbers(edge.T_from_to, edge.information);
  return query->bind(kindName(edge.kind)).bind(edge.from).bind(edge.to).bind(numbers).bind(int64_t{edge.merge}).run();
}

Result<std::vector<Edge>> MapStore::edges() const {
  const auto read =
      readEdges(state_->database, "SELECT " COMAP_EDGE_COLUMNS " FROM edges WHERE withdrawn_by = 0 ORDER BY number");
  if (!read) return read.error();
  std::vector<Edge> result;
  for (const WithdrawnEdge& one : *read) result.push_back(one.edge);
  return result;
}

Result<std::vector<WithdrawnEdge>> MapStore::withdrawnEdges() const {
  return readEdges(state_->database,
                   "SELECT " COMAP_EDGE_COLUMNS " FROM edges WHERE withdrawn_by <> 0 ORDER BY number");
}

Result<MapStore::EdgeCounts> MapStore::edgeCounts() const {
  // Two questions that indexes answer; asked as one, it would read every row.
  const auto all = countKinds(state_->database, "SELECT kind, count(*) FROM edges GROUP BY kind");
  if (!all) return all.error();
  // The plus keeps SQLite from the index of all edges, each of which it would look up.
  const auto withdrawn =
      countKinds(state_->database, "SELECT kind, count(*) FROM edges WHERE withdrawn_by <> 0 GROUP BY +kind");
  if (!withdrawn) return withdrawn.error();
  EdgeCounts counts;
  for (size_t kind = 0; kind < kEdgeKinds; ++kind) {
    counts.holding[kind] = (*all)[kind] - std::min((*all)[kind], (*withdrawn)[kind]);  // a core may write between
    counts.withdrawn += (*withdrawn)[kind];
  }
  return counts;
}

Result<void> MapStore::removeEdges(EdgeKind kind) {
  Result<Query> query = state_->database.query("DELETE FROM edges WHERE kind = ?");
  if (!query) return query.error();
  return query->bind(kindName(kind)).run();
}

Result<void> MapStore::removeClosuresOfNone() {
  return state_->database.execute("DELETE FROM edges WHERE merge <> 0 AND merge NOT IN (SELECT number FROM merges)");
}

Result<void> MapStore::withdrawEdge(const Edge& edge, uint32_t merge) {
  Database& database = state_->database;
  Result<Query> query = database.query(
      "UPDATE edges SET withdrawn_by = ?8 WHERE kind = ?1 AND from_robot = ?2 AND from_session = ?3 AND "
      "from_sequence = ?4 AND to_robot = ?5 AND to_session = ?6 AND to_sequence = ?7");
  if (!query) return query.error();
  query->bind(kindName(edge.kind)).bind(edge.from).bind(edge.to).bind(int64_t{merge});
  if (Result<void> ran = query->run(); !ran) return ran;
  if (database.changes() > 0) return {};
  return Error{ErrorCode::kWrongUse,
               database.path() + ": holds no edge from " + toString(edge.from) + " to " + toString(edge.to)};
}

Result<std::vector<Edge>> MapStore::shapingEdges() const {
  // The plus keeps SQLite from the index of all edges, each of which it would look up.
  const auto withdrawn =
      state_->database.integer("SELECT count(*) FROM edges WHERE withdrawn_by <> 0 AND +kind = 'odometry'");
  if (!withdrawn) return withdrawn.error();
  // The ends stand in an index. What no merge can withdraw need not be looked up, row by row, for whether it holds.
  const char* sql = *withdrawn == 0
                        ? "SELECT kind, from_robot, from_session, from_sequence, to_robot, to_session, to_sequence, 0 "
                          "FROM edges WHERE kind = 'odometry' UNION ALL "
                          "SELECT " COMAP_EDGE_ENDS " FROM edges WHERE merge <> 0 AND withdrawn_by = 0"
                        : "SELECT " COMAP_EDGE_ENDS
                          " FROM edges WHERE kind = 'odometry' AND withdrawn_by = 0 UNION ALL "
                          "SELECT " COMAP_EDGE_ENDS " FROM edges WHERE merge <> 0 AND withdrawn_by = 0";
  return readEnds(state_->database, sql, [](const Edge&) { return true; });
}

Result<std::vector<std::pair<KeyframeId, KeyframeId>>> MapStore::withdrawEdges(
    uint32_t merge, const std::function<bool(const Edge&)>& apart) {
  Database& database = state_->database;
  // Of the ends alone, which stand in an index; whether one holds is asked of those few that are to be withdrawn.
  std::vector<int64_t> numbers;
  auto chosen = readEnds(database,
                         "SELECT kind, from_robot, from_session, from_sequence, to_robot, to_session, to_sequence, 0, "
                         "number FROM edges WHERE kind IN ('loop', 'inter_robot', 'covisibility')",
                         apart, &numbers);
  if (!chosen) return chosen.error();
  std::vector<size_t> order(numbers.size());  // as they lie in the file
  std::iota(order.begin(), order.end(), size_t{0});
  std::sort(order.begin(), order.end(), [&](size_t a, size_t b) { return numbers[a] < numbers[b]; });
  std::vector<std::pair<KeyframeId, KeyframeId>> withdrawn;
  for (const size_t i : order) {
    Result<Query> query = database.query("UPDATE edges SET withdrawn_by = ? WHERE number = ? AND withdrawn_by = 0");
    if (!query) return query.error();
    query->bind(int64_t{merge}).bind(numbers[i]);
    if (Result<void> ran = query->run(); !ran) return ran.error();
    if (database.changes() > 0) withdrawn.emplace_back((*chosen)[i].from, (*chosen)[i].to);
  }
  return withdrawn;
}

Result<std::vector<Edge>> MapStore::restoreEdges(uint32_t merge) {
  Database& database = state_->database;
  std::vector<Edge> closures;
  {
    Result<Query> query =
        database.query("SELECT " COMAP_EDGE_ENDS " FROM edges WHERE merge = ?1 AND merge <> 0 AND +withdrawn_by = ?1");
    if (!query) return query.error();
    query->bind(int64_t{merge});
    auto read = readEnds(*query, database.path(), [](const Edge&) { return true; });
    if (!read) return read;
    closures = std::move(*read);
  }
  Result<Query> query =
      database.query("UPDATE edges SET withdrawn_by = 0 WHERE withdrawn_by = ? AND withdrawn_by <> 0");
  if (!query) return query.error();
  query->bind(int64_t{merge});
  if (Result<void> ran = query->run(); !ran) return ran.error();
  return closures;
}

}  // namespace comap
