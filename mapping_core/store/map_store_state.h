// What a MapStore holds; shared by the files that implement it.
#pragma once

#include <string>

#include "mapping_core/store/database.h"
#include "mapping_core/store/map_store.h"

namespace comap {

struct MapStore::State {
  Database database;
};

}  // namespace comap
