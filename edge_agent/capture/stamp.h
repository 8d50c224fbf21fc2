// Times as text, exact to the nanosecond: a double holds a Unix time to 0.2 microseconds only.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace comap {

/// "1305031102.175304" -> 1305031102175304000. Only digits and one point (digits on both sides if there is a point);
/// digits below the nanosecond are rounded half up. Nullopt if the text is anything else or 9e9 s and more.
std::optional<int64_t> parseStamp_ns(std::string_view text);

/// Seconds with nine decimals, trailing zeros cut down to six decimals: what parseStamp_ns reads back exactly.
std::string formatStamp(int64_t stamp_ns);

}  // namespace comap
