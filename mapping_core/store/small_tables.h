// Tables whose rows are few or small, as SQLite itself checks them. Inside this folder only.
#pragma once

#include <string>
#include <vector>

#include "protocol/storage/database.h"

namespace comap {

/// Walks the trees of all tables but the large ones and looks at every value. Rows that a page no longer counts are
/// missed by nobody else: most of these tables have no index that knows how many there are.
void checkSmallTables(Database& database, std::vector<std::string>& damage);

}  // namespace comap
