// What a MapStore holds; shared by the files that implement it.
#pragma once

#include <optional>
#include <utility>

#include "mapping_core/store/map_store.h"
#include "mapping_core/store/store_leavings.h"
#include "mapping_core/store/store_lock.h"
#include "protocol/storage/database.h"

namespace comap {

struct MapStore::State {
  State(Database opened, std::optional<StoreLock> taken) : lock(std::move(taken)), database(std::move(opened)) {
    if (!lock) guard.emplace(database.path());
  }
  ~State() {
    if (lock) database.leaveWal();
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  std::optional<StoreLock> lock;       // of a writer; outlives the database
  std::optional<EmptyLogGuard> guard;  // of a reader; so does it
  Database database;
};

}  // namespace comap
