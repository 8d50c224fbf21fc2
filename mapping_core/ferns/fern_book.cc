#include "mapping_core/ferns/fern_book.h"

#include <random>

namespace comap {
namespace {

// std::uniform_int_distribution differs between standard libraries; books must not.
uint32_t drawBelow(std::mt19937_64& generator, uint32_t bound) {
  return static_cast<uint32_t>((generator() >> 32) * bound >> 32);
}

uint64_t fnv1a(uint64_t hash, uint64_t value) {
  for (int byte = 0; byte < 8; ++byte) {
    hash ^= (value >> (8 * byte)) & 0xff;
    hash *= 0x100000001b3ull;
  }
  return hash;
}

// Bump when the meaning of a code changes (normalisation, image size), so that old and new robots do not mix.
constexpr uint64_t kEncodingVersion = 1;

}  // namespace

FernBook::FernBook(uint64_t seed, int count, uint16_t depth_min_mm, uint16_t depth_max_mm) {
  std::mt19937_64 generator(seed);
  hash_ = fnv1a(0xcbf29ce484222325ull, kEncodingVersion);
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
      hash_ = fnv1a(hash_, v);
    ferns_.push_back(fern);
  }
}

}  // namespace comap
