// The folder that a run is written to.
#pragma once

#include <string>

#include "protocol/types/result.h"

namespace comap {

/// Makes an empty folder and marks it as ours. Of a marked folder what a run writes is removed, if asked to; kWrongUse
/// for anything else that is not empty, for a run without `overwrite`, and for one that holds a file no run writes:
/// then nothing is removed.
Result<void> prepareRunFolder(const std::string& out, bool overwrite);

/// Where the map store of a run stands.
std::string storePathOf(const std::string& run);

}  // namespace comap
