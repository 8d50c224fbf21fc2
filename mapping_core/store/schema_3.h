// Schema 3, of earlier builds: how its rows become those of schema 4. Inside this folder only.
#pragma once

#include "protocol/storage/database.h"

namespace comap {

/// Statements that bring a store from schema 3 to 4; they need packed().
const char* from3To4();

/// From now on `FROM PREFIXtable` reads the rows of a store of schema 3, attached as `schema`, as those of schema 4,
/// all of them with a checksum that fits: nobody had one. Needs packed().
Result<void> showAs4(Database& database, const std::string& schema, const std::string& prefix);

}  // namespace comap
