// When there is no memory left: who cannot go on says what would help.
#pragma once

#include <string>

namespace comap {

/// From now on, the first time that no memory is left, "PROGRAM: no memory is left: ADVICE" is written to standard
/// error, by whichever thread finds it; what asked for it then fails with std::bad_alloc. Thread rule: once, from main.
void tellWhenOutOfMemory(const std::string& program, const std::string& advice);

}  // namespace comap
