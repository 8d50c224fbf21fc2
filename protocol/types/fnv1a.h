// FNV-1a, 64 bits: tells whether two sides hold the same; no protection against anybody who means harm.
#pragma once

#include <cstdint>

namespace comap {

class Fnv1a {
 public:
  /// A byte; the hash is that of the bytes one behind the other. A larger value counts as one unit.
  void add(uint64_t unit) { state_ = (state_ ^ unit) * 0x100000001b3ull; }
  /// The lowest `bytes` bytes of `value`, little endian.
  void addBytes(uint64_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) add(static_cast<uint8_t>(value >> (8 * i)));
  }
  void addAll(const auto& bytes) {
    for (const auto byte : bytes) add(static_cast<uint8_t>(byte));
  }
  uint64_t value() const { return state_; }

 private:
  uint64_t state_ = 0xcbf29ce484222325ull;
};

}  // namespace comap
