// Dependence runs downward only; this says what "down" is, folder by folder.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace comap {

/// Everything under `root` that includes what its folder must not, as "file:line includes <header>: rule"; sorted.
/// `checked` receives the number of source files read.
std::vector<std::string> includeViolations(const std::filesystem::path& root, size_t& checked);

}  // namespace comap
