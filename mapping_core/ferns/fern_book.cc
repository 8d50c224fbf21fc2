#include "mapping_core/ferns/fern_book.h"

#include <random>

#include "protocol/types/fnv1a.h"

namespace comap {
namespace {

// std::uniform_int_distribution differs between standard libraries; books must not.
uint32_t drawBelow(std::mt19937_64& generator, uint32_t bound) {
  return static_cast<uint32_t>((generator() >> 32) * bound >> 32);
}

// Bump when the meaning of a code changes (normalisation, image size), so that old and new robots do not mix.
constexpr uint64_t kEncodingVersion = 1;

}  // namespace

FernBook::FernBook(uint64_t seed, int count, uint16_t depth_min_mm, uint16_t depth_max_mm) {
  std::mt19937_64 generator(seed);
  Fnv1a hash;
  hash.addBytes(kEncodingVersion, 8);
  ferns_.reserve(static_cast<size_t>(count));
  for (int i = 0; i < count; ++i) {
    Fern fern;
    fern.x = static_cast<int>(drawBelow(generator, kFernImageWidth));
    fern.y = static_cast<int>(drawBelow(generator, kFernImageHeight));
    fern.r = static_cast<uint8_t>(drawBelow(generator, 256));
    fern.g = static_cast<uint8_t>(drawBelow(generator, 256));
    fern.b = static_cast<uint8_t>(drawBelow(generator, 256));
    fern.depth_mm = static_cast<uint16_t>(depth_min_mm + drawBelow(generator, depth_max_mm - depth_min_mm + 1u));
    for (const uint64_t v :
         {static_cast<uint64_t>(fern.x), static_cast<uint64_t>(fern.y), static_cast<uint64_t>(fern.r),
          static_cast<uint64_t>(fern.g), static_cast<uint64_t>(fern.b), static_cast<uint64_t>(fern.depth_mm)})
      hash.addBytes(v, 8);
    ferns_.push_back(fern);
  }
  hash_ = hash.value();
}

}  // namespace comap
