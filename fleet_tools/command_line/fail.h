// How every verb ends when something is wrong.
#pragma once

#include <string>

#include "protocol/types/result.h"

namespace comap {

/// Prints "fleet: <text>" to stderr and returns the exit code that belongs to the error.
int failWith(const Error& error);

/// Of a map store that could not be read; of a damaged one also what can be done.
int failWithStore(const Error& error, const std::string& store);

}  // namespace comap
