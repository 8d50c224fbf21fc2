// Files that are there are whole: written under another name first, then renamed. And no file of results takes the
// place of a database, which every map store and outbox is, or, where it can be told, of a file of another kind.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "protocol/types/result.h"

namespace comap {

enum class FileKind : uint8_t { kAny, kJson, kPng };

/// kUnreachable if `path` is there and no regular file: of a pipe the first byte would be waited for, and a device may
/// never end. What is not there is fine. For all who read a file that a person has named.
Result<void> checkRegular(const std::string& path);

/// Replaces the file `path` by `content`. kUnreachable if it cannot, or if `path` is no regular file (a device, say),
/// kWrongUse as checkReplaceable(); what was there before is then still there.
Result<void> writeWholeFile(const std::string& path, std::string_view content, FileKind kind = FileKind::kAny);

/// Whether a file `path` could be written later: its folder is there and writable, and it is replaceable. An empty path
/// is fine.
Result<void> checkWritable(const std::string& path, FileKind kind);

/// kWrongUse if `path` is a database, or neither empty nor by its first bytes of `kind`: a recording or a configuration
/// is not to be lost because its name was given twice. For those who write a file in another way.
Result<void> checkReplaceable(const std::string& path, FileKind kind);

}  // namespace comap
