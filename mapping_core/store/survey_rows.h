// How a survey goes through one table. Inside this folder only.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "protocol/storage/database.h"

namespace comap {

/// For reading, cut off or not. Of a file that is cut off `damage`, if given, gets a sentence.
Result<Database> openDamaged(const std::string& path, std::vector<std::string>* damage);

/// What was wrong with one of the row's values, if anything: the query tells it only with its next step. Ask before
/// anything of the row is kept; after it, bytes of the row are gone.
Result<void> valuesOf(Query& row);

/// Keeps the row if it is whole; else tells why not.
using RowCheck = std::function<Result<void>(Query& row)>;

/// Asks for every number from 0 to the table's last one. `last`: statement that yields it; `one`: the row of number ?1.
/// What cannot be read or does not pass is told in `damage`, neighbours together, as "WHAT NUMBER: ...". Returns how
/// many did not pass, as far as can be told.
size_t surveyTable(Database& database, const std::string& what, const char* last, const char* one,
                   const RowCheck& check, std::vector<std::string>& damage);

}  // namespace comap
