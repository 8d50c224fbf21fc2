// The folder that a run is written to.
#pragma once

#include <string>

#include "protocol/types/result.h"

namespace comap {

/// Makes an empty folder and marks it as ours. Of a marked folder what a run writes is removed, if asked to; kWrongUse
/// for anything else that is not empty, for a run without `overwrite`, and for one that holds a file no run writes:
/// then nothing is removed.
Result<void> prepareRunFolder(const std::string& out, bool overwrite);

/// Whether it is marked as ours.
bool isRunFolder(const std::string& folder);

/// Where the map store of a run stands.
std::string storePathOf(const std::string& run);
/// What a folder of several runs says of them all, and what says that one of them is finished: see run_series.
std::string seriesMarkOf(const std::string& out);
std::string finishedMarkOf(const std::string& run);
size_t finishedRunsIn(const std::string& out);

}  // namespace comap
