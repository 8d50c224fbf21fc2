// What parts of the odometry take from the heap: numbers a frame, and the places that take it.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "tests/benchmarks/odometry/our_odometry.h"

namespace comap {

/// False where the heap cannot be watched: built with a sanitizer, which watches it itself.
bool canCountAllocations();

/// Counts the calling thread's malloc, and all that ends there, between begin and end. One at a time.
class AllocationCounter final : public OurOdometry::Probe {
 public:
  struct Sum {
    uint64_t runs = 0, allocations = 0, bytes = 0, worst = 0;  ///< worst: allocations in one run
  };
  struct Place {
    std::string part;
    uint64_t allocations = 0, bytes = 0;
    std::vector<std::string> calls;  ///< innermost first
  };

  /// `places`: also notes from where; slow.
  explicit AllocationCounter(bool places);

  void begin(const char* part) override;
  void end() override;
  /// Forgets everything so far: after warm-up.
  void reset();

  const std::map<std::string, Sum>& sums() const { return sums_; }
  /// Most allocations first. Function names by addr2line (of binutils); without it, addresses.
  std::vector<Place> places() const;

 private:
  bool places_wanted_;
  std::string part_;
  std::map<std::string, Sum> sums_;
};

}  // namespace comap
