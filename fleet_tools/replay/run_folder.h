// The folder that a run is written to.
#pragma once

#include <string>

#include "protocol/types/result.h"

namespace comap {

/// Makes an empty folder and marks it as ours. A run folder is made by this program, so it may be emptied if asked;
/// kWrongUse for anything else that is not empty, and for a run without `overwrite`.
Result<void> prepareRunFolder(const std::string& out, bool overwrite);

/// Where the map store of a run stands.
std::string storePathOf(const std::string& run);

}  // namespace comap
