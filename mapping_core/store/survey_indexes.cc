#include "mapping_core/store/survey_indexes.h"

#include <algorithm>
#include <array>
#include <compare>
#include <cstring>
#include <string>

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
                              "SELECT robot, session, sequence, arrival FROM main.keyframes INDEXED BY "
                              "sqlite_autoindex_keyframes_1",
                              "tiii"};
constexpr Index kEdges = {"sqlite_autoindex_edges_1",
                          "SELECT kind, from_robot, from_session, from_sequence, to_robot, to_session, to_sequence, "
                          "number FROM main.edges INDEXED BY sqlite_autoindex_edges_1",
                          "ttiitiii"};
constexpr Index kWithdrawnEdges = {
    "edges_withdrawn_by_kind",
    "SELECT withdrawn_by, kind, number FROM main.edges INDEXED BY edges_withdrawn_by_kind "
    "WHERE withdrawn_by <> 0",
    "iti"};
constexpr Index kEdgesOfMerges = {
    "edges_of_merges", "SELECT merge, number FROM main.edges INDEXED BY edges_of_merges WHERE merge <> 0", "ii"};
constexpr Index kVerdicts = {"verdicts_by_reason",
                             "SELECT accepted, reason, number FROM main.verdicts INDEXED BY verdicts_by_reason", "iti"};

// Entries as they come, each compared with the one before. Texts by their bytes, as SQLite compares them.
class Rising {
 public:
  void number(int64_t value) {
    if (order_ == 0) order_ = value <=> before_[column_].number;
    before_[column_++].number = value;
  }
  void text(std::string_view value) {
    std::string& before = before_[column_++].text;
    const auto order = value.compare(before);
    if (order == 0) return;
    if (order_ == 0) order_ = order <=> 0;
    before = value;
  }
  /// At the end of an entry: whether it is above the one before, or the first.
  bool rises() {
    const bool above = first_ || order_ > 0;
    first_ = false;
    order_ = std::strong_ordering::equal;
    column_ = 0;
    return above;
  }

 private:
  struct Cell {
    int64_t number = 0;
    std::string text;
  };
  std::array<Cell, 8> before_;
  std::strong_ordering order_ = std::strong_ordering::equal;
  size_t column_ = 0;
  bool first_ = true;
};

Result<bool> isThere(Database& database, const Index& index) {
  auto query = database.query("SELECT count(*) FROM sqlite_schema WHERE type = 'index' AND name = ?");
  if (!query) return query.error();
  const auto row = query->bind(std::string(index.name)).step();
  if (!row) return row.error();
  return query->integer() > 0;
}

FoundIndex readIndex(Database& database, const Index& index) {
  FoundIndex found;
  const auto there = isThere(database, index);
  found.there = there && *there;
  found.sound = bool(there);
  if (!found.there) return found;
  auto query = database.query(index.sql);
  found.sound = bool(query);
  for (Rising order; found.sound;) {
    const auto row = query->step();
    found.sound = bool(row);
    if (!row || !*row) break;
    found.sound = query->areOf(index.types);
    EntryHash hash;
    for (const char type : index.types) {
      if (type == 't') {
        const std::string_view text = query->textView();
        order.text(text);
        hash.add(text);
      } else {
        const int64_t number = query->integer();
        order.number(number);
        hash.add(number);
      }
    }
    found.sound = found.sound && order.rises();
    found.entries.add(hash);
  }
  return found;
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

FoundIndexes readIndexes(Database& database) {
  return {readIndex(database, kKeyframes), readIndex(database, kEdges), readIndex(database, kWithdrawnEdges),
          readIndex(database, kEdgesOfMerges), readIndex(database, kVerdicts)};
}

FoundIndex readWithdrawnEdges(Database& database) { return readIndex(database, kWithdrawnEdges); }
FoundIndex readEdgesOfMerges(Database& database) { return readIndex(database, kEdgesOfMerges); }

void addPartialEntries(IndexEntries& entries, int64_t number, std::string_view kind, int64_t merge,
                       int64_t withdrawn_by) {
  if (withdrawn_by != 0) entries.withdrawn_edges.add(EntryHash().add(withdrawn_by).add(kind).add(number));
  if (merge != 0) entries.edges_of_merges.add(EntryHash().add(merge).add(number));
}

}  // namespace comap
