// What a verb may write over.
#pragma once

#include <string>

#include "protocol/types/result.h"

namespace comap {

/// For `--out`, a file: one that is there is replaced, unless it is a database, as every map store and outbox is, or no
/// regular file at all. kWrongUse if it may not be written over, kUnreachable if its folder is not there.
Result<void> checkOutputFile(const std::string& path);

/// For `--out`, a folder to be made or added to. kWrongUse if something else stands there.
Result<void> checkOutputFolder(const std::string& path);

}  // namespace comap
