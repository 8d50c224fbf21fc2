// Where capture tells people what happens.
#pragma once

#include <functional>
#include <string>

namespace comap {

/// Takes one line without an end of line; an empty function is told nothing where that is allowed.
using CaptureLog = std::function<void(const std::string& line)>;

}  // namespace comap
