// Whether an index says what its table says, told by one pass over each. Inside this folder only.
#pragma once

#include <cstdint>
#include <string_view>

#include "mapping_core/store/map_store.h"
#include "protocol/storage/database.h"

namespace comap {

/// One entry of an index: its columns, then the row's number.
class EntryHash {
 public:
  EntryHash& add(int64_t value);
  EntryHash& add(std::string_view text);
  EntryHash& add(const KeyframeId& id);
  uint64_t value() const { return state_; }

 private:
  uint64_t state_ = 0x9e3779b97f4a7c15ull;
};

/// Entries in any order: two sums are the same if, and as good as only if, their entries are.
class EntrySum {
 public:
  void add(const EntryHash& entry) {
    sum_ += entry.value();
    ++count_;
  }
  bool operator==(const EntrySum&) const = default;

 private:
  uint64_t sum_ = 0, count_ = 0;
};

/// What the indexes must hold, by what the rows say.
struct IndexEntries {
  EntrySum keyframes;                                ///< robot, session, sequence
  EntrySum edges, withdrawn_edges, edges_of_merges;  ///< kind and ends; withdrawn_by and kind; merge
  EntrySum verdicts;                                 ///< accepted, reason
};

/// What an index says. One that is not in the file says nothing wrong.
struct FoundIndex {
  bool there = false;
  bool sound = true;  ///< it can be read, and its entries rise
  EntrySum entries;
  /// Whether it can be copied as it lies there.
  bool says(const EntrySum& rows) const { return sound && (!there || entries == rows); }
};
struct FoundIndexes {
  FoundIndex keyframes, edges, withdrawn_edges, edges_of_merges, verdicts;
};

/// Reads the indexes of large tables, and no row of these.
FoundIndexes readIndexes(Database& database);

/// Of these, those of the few edges that were withdrawn or are closures of merges.
FoundIndex readWithdrawnEdges(Database& database);
FoundIndex readEdgesOfMerges(Database& database);
/// Adds the entries that an edge has in these two.
void addPartialEntries(IndexEntries& entries, int64_t number, std::string_view kind, int64_t merge,
                       int64_t withdrawn_by);

}  // namespace comap
