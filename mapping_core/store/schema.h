// The tables of a map store, and whether a file is one.
#pragma once

#include "protocol/storage/database.h"

namespace comap {

inline constexpr int64_t kStoreApplicationId = 0x436f4d61;  ///< "CoMa" in the file's header
inline constexpr int64_t kStoreVersion = 3;                 ///< user_version in the file's header

/// Makes the tables in an empty database, all or none.
Result<void> createSchema(Database& database);

/// kBadData, with what was found and expected, if it is another application's database or of another version.
/// Returns false if the database is empty.
Result<bool> checkSchema(Database& database);

}  // namespace comap
