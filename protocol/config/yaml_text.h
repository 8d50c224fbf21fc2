// Text as a YAML file holds it.
#pragma once

#include <string>

namespace comap {

/// In double quotes, with all escaped that would end or change it; bytes that are no UTF-8 become U+FFFD.
std::string yamlText(const std::string& text);

}  // namespace comap
