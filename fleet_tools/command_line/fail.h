// How every verb ends when something is wrong.
#pragma once

#include "protocol/types/result.h"

namespace comap {

/// Prints "fleet: <text>" to stderr and returns the exit code that belongs to the error.
int failWith(const Error& error);

}  // namespace comap
