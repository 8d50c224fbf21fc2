// Numbers with their nouns, for people.
#pragma once

#include <array>
#include <cstdio>
#include <string>

namespace comap {

/// "1 merge", "2 merges".
inline std::string counted(size_t count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

/// `one` or `many`, as the count wants it: "is" or "are".
inline const char* wordFor(size_t count, const char* one, const char* many) { return count == 1 ? one : many; }

/// "950 B", "1.2 kB", "3.4 GB".
inline std::string humanBytes(double bytes) {
  constexpr std::array<const char*, 5> kUnits = {"B", "kB", "MB", "GB", "TB"};
  size_t unit = 0;
  while (bytes >= 999.5 && unit + 1 < kUnits.size()) {
    bytes /= 1000;
    ++unit;
  }
  char text[40];
  std::snprintf(text, sizeof text, unit == 0 ? "%.0f %s" : "%.1f %s", bytes, kUnits[unit]);
  return text;
}

}  // namespace comap
