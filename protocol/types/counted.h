// Numbers with their nouns, for people.
#pragma once

#include <string>

namespace comap {

/// "1 merge", "2 merges".
inline std::string counted(size_t count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

/// `one` or `many`, as the count wants it: "is" or "are".
inline const char* wordFor(size_t count, const char* one, const char* many) { return count == 1 ? one : many; }

}  // namespace comap
