// What a MapStore holds; shared by the files that implement it.
#pragma once

#include <utility>

#include "mapping_core/store/map_store.h"
#include "protocol/storage/database.h"

namespace comap {

struct MapStore::State {
  State(Database opened, Mode mode) : database(std::move(opened)), writes(mode != Mode::kReadOnly) {}
  ~State() {
    if (writes) database.leaveWal();
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  Database database;
  bool writes;
};

}  // namespace comap
