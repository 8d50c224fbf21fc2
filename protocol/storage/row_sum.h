// The checksum of a row: what SQL calls row_sum(...).
#pragma once

#include <sqlite3.h>

namespace comap {

/// From now on statements know row_sum(...), of any number of values: the CRC-32 (zlib's) of all of them, one behind
/// the other, each as a letter and what follows: "n" NULL; "i" INTEGER and "r" REAL, 8 bytes; "t" TEXT and "b" BLOB,
/// their length in 8 bytes and themselves. Numbers little endian; a REAL that is 0 without its sign, as SQLite keeps
/// it. Returns SQLite's code.
int addRowSum(sqlite3* database);

}  // namespace comap
