// Whether a store looks whole, as far as can be told without reading its pictures: a second or two at any size.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "protocol/types/result.h"

namespace comap {

/// What was looked at: every row, held against its checksum, and which keyframes it names; of pictures and tiles as
/// many as are said, evenly over the store.
struct StoreGlance {
  std::string path;
  size_t keyframes = 0, edges = 0, verdicts = 0, merges = 0, tiles = 0;
  size_t pictures_read = 0, tiles_read = 0;
  uint64_t bytes = 0;                ///< of the file
  std::vector<std::string> damage;   ///< a sentence each; empty: none was seen
  std::vector<std::string> remarks;  ///< what is no damage, but worth knowing
};

/// Reads only, all as it was at one moment. `most_read`: pictures, and tiles, that are read. kUnreachable or kBadData
/// if the file is no store, or so damaged that nothing of it can be told.
Result<StoreGlance> glanceAtStore(const std::string& path, size_t most_read = 200);

}  // namespace comap
