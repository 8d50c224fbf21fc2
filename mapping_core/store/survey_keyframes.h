// The keyframes of a store that may be damaged. Inside this folder only.
#pragma once

#include "mapping_core/store/store_survey.h"
#include "mapping_core/store/survey_indexes.h"
#include "protocol/storage/database.h"

namespace comap {

/// Fills keyframes, lost_keyframes and what there is to say of them. A keyframe is whole if its message is; the row
/// that describes it can be lost, the message describes itself.
/// Adds to `entries` what the rows that describe them say. `progress` (may be empty) hears (done, all).
void surveyKeyframes(Database& database, StoreSurvey& survey, IndexEntries& entries,
                     const std::function<void(size_t, size_t)>& progress);

/// Whether the message of the keyframe of this number is whole: one whose row was read.
Result<void> checkMessage(Database& database, int64_t arrival);

/// The message of one that was found whole.
Result<std::vector<uint8_t>> messageOf(Database& database, uint32_t arrival);

}  // namespace comap
