// What a view looks like, in few bytes: the answers of a book of tests at fixed pixels.
#pragma once

#include <cstdint>
#include <vector>

namespace comap {

/// One randomised-fern code of an image: per fern 4 bits (R, G, B, depth above their thresholds), or kBad where the
/// pixel has no depth. Codes are comparable only if made with one book: `book_hash` says which.
struct FernCode {
  static constexpr uint8_t kBad = 0xff;
  uint64_t book_hash = 0;
  std::vector<uint8_t> codes;  ///< one per fern, 0..15 or kBad
  bool operator==(const FernCode&) const = default;
};

}  // namespace comap
