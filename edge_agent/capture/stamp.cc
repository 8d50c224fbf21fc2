#include "edge_agent/capture/stamp.h"

#include <cstdio>

namespace comap {

std::optional<int64_t> parseStamp_ns(std::string_view text) {
  constexpr int64_t kNanoseconds = 1'000'000'000;
  constexpr int64_t kTooLate_s = 9'000'000'000;
  int64_t seconds = 0;
  size_t i = 0;
  for (; i < text.size() && text[i] >= '0' && text[i] <= '9'; ++i) {
    seconds = seconds * 10 + (text[i] - '0');
    if (seconds >= kTooLate_s) return std::nullopt;
  }
  if (i == 0) return std::nullopt;
  if (i == text.size()) return seconds * kNanoseconds;
  if (text[i] != '.' || i + 1 == text.size()) return std::nullopt;

  int64_t fraction_ns = 0;
  int64_t place_ns = kNanoseconds;
  bool round_up = false;
  for (++i; i < text.size(); ++i) {
    if (text[i] < '0' || text[i] > '9') return std::nullopt;
    if (place_ns == 1) {
      round_up = text[i] >= '5';
      place_ns = 0;
    }
    place_ns /= 10;
    fraction_ns += place_ns * (text[i] - '0');
  }
  return seconds * kNanoseconds + fraction_ns + (round_up ? 1 : 0);
}

std::string formatStamp(int64_t stamp_ns) {
  const bool negative = stamp_ns < 0;
  const uint64_t magnitude = negative ? 0 - static_cast<uint64_t>(stamp_ns) : static_cast<uint64_t>(stamp_ns);
  char text[40];
  std::snprintf(text, sizeof text, "%s%llu.%09llu", negative ? "-" : "",
                static_cast<unsigned long long>(magnitude / 1'000'000'000),
                static_cast<unsigned long long>(magnitude % 1'000'000'000));
  std::string result = text;
  for (int cut = 0; cut < 3 && result.back() == '0'; ++cut) result.pop_back();
  return result;
}

}  // namespace comap
