// How a survey goes through one table. Inside this folder only.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "mapping_core/store/kept_rows.h"
#include "protocol/storage/database.h"

namespace comap {

/// For reading, cut off or not; a store of an older schema reads as one of the newest, but for its indexes.
/// kUnreachable if it is not there or no file.
Result<Database> openDamaged(const std::string& path);

/// Where the database attached as `schema` is of an older schema, `FROM PREFIXtable` reads as of the newest from now
/// on; false: it is not, and nothing was done.
Result<bool> showAsNewest(Database& database, const std::string& schema, const std::string& prefix);

/// Whether a core may write on while a transaction is held here; without a log it could not start.
bool hasLog(Database& database);

/// Calls `look` with a store in which all is of one moment, though a core writes meanwhile: table by table, edges would
/// come without their keyframes. It is called again if a core has begun to write since.
Result<void> atOneMoment(const std::string& path, const std::function<Result<void>(Database&)>& look);

/// Says so if a store of the newest schema declares its tables in other words than this program: one bit can make
/// a column of another one.
void tellDeclarations(Database& database, std::vector<std::string>& damage);

/// Says how the store's log ends, if that is not as it should be.
void tellLogEnd(const std::string& path, std::vector<std::string>& damage, std::vector<std::string>& remarks);

/// Says so if the file was not written anew since a robot was forgotten.
void remarkCompactDue(Database& database, std::vector<std::string>& remarks);

/// Why a row is not taken that does not fit its checksum.
inline constexpr const char* kUnsound = "its checksum is not that of its values";

/// Of a table that is not in order, so that rows may be neither found nor missed by their number.
inline constexpr const char* kOutOfOrder = "their table cannot be read in order to its end, rows may be missing";

/// That of columns as Query::rowState() takes them neither is wrong; else kBadData.
Result<void> checkRow(const Query& row, std::string_view types);

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
#define COMAP_TABLE_ROWS(table, number, columns)                                                                      \
  TableRows {                                                                                                         \
    "SELECT coalesce(max(" number "), 0) FROM main." table, "SELECT " columns " FROM " table " WHERE " number " = ?", \
        "SELECT " number ", " columns " FROM " table " ORDER BY " number                                              \
  }

/// Reads the rows one behind the other; where that ends early, or they are out of order, asks from there on for every
/// number up to the table's last one. What cannot be read or does not pass is told in `damage`, neighbours together, as
/// "WHAT NUMBER: ..."; the others are added to `kept`. Returns how many did not pass, as far as can be told.
size_t surveyTable(Database& database, const std::string& what, const TableRows& rows, const RowCheck& check,
                   std::vector<std::string>& damage, KeptRows& kept);

}  // namespace comap
