// associations.txt, or (first byte odd) rgb.txt and depth.txt, parted by a byte 0xff.
#include <algorithm>

#include "edge_agent/capture/tum_index.h"
#include "tests/fuzz/fuzz.h"

using namespace comap;

COMAP_FUZZ_TARGET(bytes) {
  static const fuzz::MemoryFolder folder;
  if (bytes.empty()) return;
  const bool two = bytes[0] % 2 == 1;
  bytes = bytes.subspan(1);
  for (const char* name : {"associations.txt", "rgb.txt", "depth.txt"}) std::filesystem::remove(folder / name);
  if (two) {
    const auto at = static_cast<size_t>(std::find(bytes.begin(), bytes.end(), uint8_t{0xff}) - bytes.begin());
    folder.write("rgb.txt", bytes.first(at));
    folder.write("depth.txt", bytes.subspan(std::min(at + 1, bytes.size())));
  } else {
    folder.write("associations.txt", bytes);
  }
  const auto pairs = readTumPairs(folder / "");
  if (!pairs) return;
  for (size_t i = 1; i < pairs->size(); ++i)
    fuzz::require((*pairs)[i - 1].stamp_ns <= (*pairs)[i].stamp_ns, "pairs are in order of time");
  for (const TumPair& pair : *pairs)
    for (const std::string& path : {pair.colour_path, pair.depth_path})
      fuzz::require(path.find("/../") == std::string::npos && path.starts_with(folder / ""),
                    "a picture is in its folder");
}
