// Files that are there are whole: written under another name first, then renamed.
#pragma once

#include <string>
#include <string_view>

#include "protocol/types/result.h"

namespace comap {

/// Replaces the file `path` by `content`. kUnreachable if it cannot; what was there before is then still there.
Result<void> writeWholeFile(const std::string& path, std::string_view content);

}  // namespace comap
