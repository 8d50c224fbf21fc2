// Files that are there are whole: written under another name first, then renamed.
#pragma once

#include <string>
#include <string_view>

#include "protocol/types/result.h"

namespace comap {

/// Replaces the file `path` by `content`. kUnreachable if it cannot, or if `path` is no regular file (a device, say);
/// what was there before is then still there.
Result<void> writeWholeFile(const std::string& path, std::string_view content);

/// Whether a file `path` could be written later: its folder is there and writable. An empty path is fine.
Result<void> checkFolderOf(const std::string& path);

}  // namespace comap
