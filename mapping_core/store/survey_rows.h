// How a survey goes through one table. Inside this folder only.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "mapping_core/store/kept_rows.h"
#include "protocol/storage/database.h"

namespace comap {

/// For reading, cut off or not; statements know reals(). kUnreachable if it is not there or no file.
Result<Database> openDamaged(const std::string& path);

/// Calls `look` with a store in which all is of one moment, though a core writes meanwhile: table by table, edges would
/// come without their keyframes. It is called again if a core has begun to write since.
Result<void> atOneMoment(const std::string& path, const std::function<Result<void>(Database&)>& look);

/// What to say of a file whose end is missing; empty if it is there.
std::string cutOffText(const std::string& path);

/// Says so if the file was not written anew since a robot was forgotten.
void remarkCompactDue(Database& database, std::vector<std::string>& remarks);

/// Adds each line of a text by itself.
void addLines(const std::string& prefix, const std::string& text, std::vector<std::string>& damage);

/// Keeps the row of this number if it is whole; else tells why not, and keeps nothing. What is wrong with a value is in
/// row.values().
using RowCheck = std::function<Result<void>(int64_t number, Query& row)>;

/// The statements by which a table is gone through.
struct TableRows {
  const char* last;  ///< yields the last number
  const char* one;   ///< the columns of the row of number ?1
  const char* all;   ///< number and columns of all rows, by number
};
#define COMAP_TABLE_ROWS(table, number, columns)                                                                 \
  TableRows {                                                                                                    \
    "SELECT coalesce(max(" number "), 0) FROM " table, "SELECT " columns " FROM " table " WHERE " number " = ?", \
        "SELECT " number ", " columns " FROM " table " ORDER BY " number                                         \
  }

/// Reads the rows one behind the other; where that ends early, or they are out of order, asks from there on for every
/// number up to the table's last one. What cannot be read or does not pass is told in `damage`, neighbours together, as
/// "WHAT NUMBER: ..."; the others are added to `kept`. Returns how many did not pass, as far as can be told.
size_t surveyTable(Database& database, const std::string& what, const TableRows& rows, const RowCheck& check,
                   std::vector<std::string>& damage, KeptRows& kept);

}  // namespace comap
