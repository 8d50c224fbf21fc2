// What a verb may write over.
#pragma once

#include <string>

#include "protocol/types/result.h"

namespace comap {

/// kWrongUse if `path` is a database, as every map store and outbox is: a picture or an export never takes its place.
Result<void> refuseDatabase(const std::string& path);

}  // namespace comap
