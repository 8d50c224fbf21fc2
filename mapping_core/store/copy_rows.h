// Rows that a survey found whole, from one file into another, by SQLite itself. Inside this folder only.
#pragma once

#include "mapping_core/store/store_survey.h"
#include "protocol/storage/database.h"

namespace comap {

/// Makes a store at `path`, or where copyUnseen() has made one keeps of it what is whole; copies keyframes, poses,
/// edges, verdicts and merges; of all but keyframes only what their numbers in the survey are. Indexes for speed that
/// the damaged one lacks are left to whoever opens it. Until it is closed a crash leaves it useless.
Result<void> copyWholeRows(const StoreSurvey& survey, const std::string& path, bool copied);

}  // namespace comap
