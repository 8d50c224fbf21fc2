// What people can do about a store that is damaged.
#pragma once

#include <string>

#include "protocol/types/result.h"

namespace comap {

/// Of an error of damaged data (kBadData) met in the file `store`: the same, and which commands look at and save it.
/// Any other error as it is.
Error withRemedy(const Error& error, const std::string& store);

}  // namespace comap
