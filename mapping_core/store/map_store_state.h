// What a MapStore holds; shared by the files that implement it.
#pragma once

#include <memory>
#include <optional>
#include <utility>

#include "mapping_core/store/map_store.h"
#include "mapping_core/store/store_leavings.h"
#include "mapping_core/store/store_lock.h"
#include "protocol/storage/database.h"

namespace comap {

struct MapStore::State {
  State(Database opened, std::optional<StoreLock> taken, std::unique_ptr<LeavingsGuard> of_reader)
      : guard(std::move(of_reader)), lock(std::move(taken)), database(std::move(opened)) {}
  ~State() {
    if (lock) database.leaveWal();
  }
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  std::unique_ptr<LeavingsGuard> guard;  // of a reader; outlives the database
  std::optional<StoreLock> lock;         // of a writer; so does it
  Database database;
};

}  // namespace comap
