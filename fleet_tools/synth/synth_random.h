// Random numbers that are a function of a counter: the same on every machine and in every order of evaluation.
#pragma once

#include <cstdint>

namespace comap {

/// A well-mixed 64-bit number for each input (the finaliser of splitmix64).
constexpr uint64_t mixBits(uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

constexpr uint64_t mixBits(uint64_t a, uint64_t b) { return mixBits(mixBits(a) ^ b); }
constexpr uint64_t mixBits(uint64_t a, uint64_t b, uint64_t c) { return mixBits(mixBits(a, b) ^ c); }

/// [0, 1)
constexpr float unitFloat(uint64_t bits) { return static_cast<float>(bits >> 40) * 0x1p-24f; }

/// A stream of numbers for building things.
class RandomStream {
 public:
  explicit RandomStream(uint64_t seed) : key_(mixBits(seed)) {}
  uint64_t bits() { return mixBits(key_, ++count_); }
  float uniform(float low, float high) { return low + (high - low) * unitFloat(bits()); }
  int below(int limit) { return static_cast<int>(bits() % static_cast<uint64_t>(limit)); }

 private:
  uint64_t key_;
  uint64_t count_ = 0;
};

/// Standard normal numbers: entry i of kNormalEntries is the ((i + 0.5) / kNormalEntries)-quantile, so that a uniform
/// index gives a normal number. Cheap, and the same everywhere, unlike a library's own distribution.
inline constexpr uint64_t kNormalEntries = 1 << 14;
const float* normalTable();

}  // namespace comap
