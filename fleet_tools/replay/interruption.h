// What is said of a run that a person ends.
#pragma once

#include <string>

namespace comap {

/// From now on SIGINT and SIGTERM write "fleet: interrupted: WHAT" to standard error, and then end the program as they
/// would have.
void tellWhenInterrupted(const std::string& what);

}  // namespace comap
