// The first page of an SQLite file: how large its pages are and how many, and where its tables begin. A file whose own
// is damaged can be read with that of another one whose tables were made in the same order.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace comap {

/// The first `bytes` of a file; nothing if it has fewer, or cannot be read.
std::vector<char> firstBytesOf(const std::string& path, size_t bytes);

/// The first page of a whole file, to be lent to others; nothing if it cannot be read.
std::vector<char> firstPageOf(const std::string& path);

/// Writes over the beginning of a file. False if it cannot be written.
bool overwriteStart(const std::string& path, const std::vector<char>& bytes);

/// `page`, told how many pages the file at `path` has, and that none of them is free: what is would be read at most,
/// and nothing leads there. Nothing if the file has no page beside its first one.
std::vector<char> fitFirstPage(std::vector<char> page, const std::string& path);

/// What of the head of an SQLite file says something that none of this project's files ever does, a sentence each.
/// Empty if it is no such file at all. Not judged: counters of changes and of schemas, the version of the library that
/// wrote it, the size of its cache, of which any value is as good; and what others judge: size and number of pages,
/// application and version.
std::vector<std::string> headDamage(const std::string& path);

/// Writes what it should say over that. False if it cannot be written.
bool mendHead(const std::string& path);

}  // namespace comap
