#include "mapping_core/store/survey_indexes.h"

#include <algorithm>
#include <array>
#include <compare>
#include <cstring>
#include <string>
#include <utility>

namespace comap {
namespace {

uint64_t mixed(uint64_t state, uint64_t unit) {
  state = (state ^ unit) * 0xbf58476d1ce4e5b9ull;
  return state ^ state >> 31;
}

// An index, and how its entries are read in its own order without a look at the rows.
struct Index {
  const char* name;
  const char* sql;
  std::string_view types;  // of the entry's columns, as Query::areOf takes them
};

constexpr Index kKeyframes = {"sqlite_autoindex_keyframes_1",
                              "SELECT robot, session, sequence, arrival FROM keyframes INDEXED BY "
                              "sqlite_autoindex_keyframes_1",
                              "tiii"};
constexpr Index kEdges = {"sqlite_autoindex_edges_1",
                          "SELECT kind, from_robot, from_session, from_sequence, to_robot, to_session, to_sequence, "
                          "number FROM edges INDEXED BY sqlite_autoindex_edges_1",
                          "ttiitiii"};
constexpr Index kWithdrawnEdges = {"edges_withdrawn_by_kind",
                                   "SELECT withdrawn_by, kind, number FROM edges INDEXED BY edges_withdrawn_by_kind "
                                   "WHERE withdrawn_by <> 0",
                                   "iti"};
constexpr Index kEdgesOfMerges = {"edges_of_merges",
                                  "SELECT merge, number FROM edges INDEXED BY edges_of_merges WHERE merge <> 0", "ii"};
constexpr Index kVerdicts = {"verdicts_by_reason",
                             "SELECT accepted, reason, number FROM verdicts INDEXED BY verdicts_by_reason", "iti"};

struct Cell {
  int64_t number = 0;
  std::string text;
  auto operator<=>(const Cell&) const = default;
};

// Bytes, as SQLite compares texts: std::string compares them as unsigned, too.
using Entry = std::array<Cell, 8>;

Result<bool> isThere(Database& database, const Index& index) {
  auto query = database.query("SELECT count(*) FROM sqlite_schema WHERE type = 'index' AND name = ?");
  if (!query) return query.error();
  const auto row = query->bind(std::string(index.name)).step();
  if (!row) return row.error();
  return query->integer() > 0;
}

bool holds(Database& database, const Index& index, const EntrySum& expected) {
  const auto there = isThere(database, index);
  if (!there || !*there) return bool(there);
  auto query = database.query(index.sql);
  if (!query) return false;
  EntrySum found;
  Entry before, entry;
  for (bool first = true;; first = false) {
    const auto row = query->step();
    if (!row) return false;
    if (!*row) return found == expected;
    if (!query->areOf(index.types)) return false;
    EntryHash hash;
    for (size_t i = 0; i < index.types.size(); ++i) {
      if (index.types[i] == 't') {
        entry[i].text = query->text();
        hash.add(std::string_view(entry[i].text));
      } else {
        entry[i].number = query->integer();
        hash.add(entry[i].number);
      }
    }
    if (!first && !(before < entry)) return false;
    std::swap(before, entry);
    found.add(hash);
  }
}

}  // namespace

EntryHash& EntryHash::add(int64_t value) {
  state_ = mixed(state_, static_cast<uint64_t>(value));
  return *this;
}

EntryHash& EntryHash::add(std::string_view text) {
  state_ = mixed(state_, text.size());
  for (; !text.empty(); text.remove_prefix(std::min(text.size(), sizeof(uint64_t)))) {
    uint64_t unit = 0;
    std::memcpy(&unit, text.data(), std::min(text.size(), sizeof unit));
    state_ = mixed(state_, unit);
  }
  return *this;
}

EntryHash& EntryHash::add(const KeyframeId& id) {
  return add(std::string_view(id.robot)).add(static_cast<int64_t>(id.session)).add(int64_t{id.sequence});
}

bool areKeyframeIndexesWhole(Database& database, const IndexEntries& entries) {
  return holds(database, kKeyframes, entries.keyframes);
}

bool areEdgeIndexesWhole(Database& database, const IndexEntries& entries) {
  return holds(database, kEdges, entries.edges) && holds(database, kWithdrawnEdges, entries.withdrawn_edges) &&
         holds(database, kEdgesOfMerges, entries.edges_of_merges);
}

bool areVerdictIndexesWhole(Database& database, const IndexEntries& entries) {
  return holds(database, kVerdicts, entries.verdicts);
}

}  // namespace comap
