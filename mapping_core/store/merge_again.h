// When merges that had been undone were given again: an entry of meta each. Inside this folder only.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "protocol/storage/database.h"

namespace comap {

/// The entry's name.
std::string againKey(uint32_t merge);

/// The merge that an entry of this name is about; nothing if it is about something else.
std::optional<uint32_t> mergeOfAgainKey(const std::string& key);

/// Takes out the entries of merges that are not there: their numbers will be given to others.
Result<void> dropAgainOfNone(Database& database);

}  // namespace comap
