// Files that are there are whole: written under another name first, then renamed. And no file of results takes the
// place of a database: every map store and outbox is one.
#pragma once

#include <string>
#include <string_view>

#include "protocol/types/result.h"

namespace comap {

/// Replaces the file `path` by `content`. kUnreachable if it cannot, or if `path` is no regular file (a device, say),
/// kWrongUse if it is a database; what was there before is then still there.
Result<void> writeWholeFile(const std::string& path, std::string_view content);

/// Whether a file `path` could be written later: its folder is there and writable, and it is no database. An empty path
/// is fine.
Result<void> checkWritable(const std::string& path);

/// kWrongUse if `path` is a database. For those who write a file in another way.
Result<void> checkNoDatabase(const std::string& path);

}  // namespace comap
