// Messages of a damaged store to which no page leads any more. Inside this folder only.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>

#include "mapping_core/store/store_survey.h"
#include "protocol/storage/database.h"
#include "protocol/storage/leaf_rows.h"

namespace comap {

/// Where those lie of which `sizes` gives number and bytes, and that `isWhole`, by number. Reads every page by itself,
/// past SQLite, of the file alone: not of its log.
std::map<int64_t, LeafRow> findStrays(
    const std::string& path, const std::map<int64_t, int64_t>& sizes,
    const std::function<bool(int64_t number, std::span<const uint8_t> message)>& isWhole);

/// Writes those that a survey found among the messages of `to`.
Result<void> copyStrays(Database& to, const StoreSurvey& survey);

}  // namespace comap
