// Small pieces of HTML from text that is not trusted.
#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace comap {

/// Safe as element content and inside quoted attributes; control characters and invalid UTF-8 become '?'.
std::string htmlEscape(const std::string& text);

/// RFC 4648, with padding.
std::string base64(std::span<const uint8_t> bytes);

}  // namespace comap
