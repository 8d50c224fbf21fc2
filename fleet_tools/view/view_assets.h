// The page's files, built into the program.
#pragma once

#include <span>
#include <string_view>

namespace comap {

struct ViewAsset {
  std::string_view path;  ///< as asked for: "/main.js"
  std::string_view type;  ///< MIME
  std::string_view content;
};

std::span<const ViewAsset> viewAssets();

}  // namespace comap
