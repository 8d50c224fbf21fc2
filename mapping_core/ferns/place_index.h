// Which keyframes look like this one: fern codes compared 64 at a time, bit by bit.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "protocol/types/keyframe.h"

namespace comap {

struct PlaceCandidate {
  uint32_t place = 0;
  double dissimilarity = 1;  ///< share of jointly valid ferns that differ, 0..1
};

/// Share of ferns valid in both that differ; 1 if books differ or fewer than a tenth of the ferns are valid in both.
double dissimilarity(const FernCode& a, const FernCode& b);

/// Thread rule: add from one thread; query from many when none adds.
class PlaceIndex {
 public:
  /// `place` is the caller's number for the keyframe. False if the code's size or book differs from earlier ones.
  bool add(uint32_t place, const FernCode& code);

  /// The `count` most similar places that `admit` lets pass, most similar first; ties by lower number; none that
  /// differs by more than `max_dissimilarity`. `admit` is asked only of places that are more similar than the last one
  /// found; it must not depend on the order of asking.
  std::vector<PlaceCandidate> query(const FernCode& code, size_t count,
                                    const std::function<bool(uint32_t place)>& admit,
                                    double max_dissimilarity = 1) const;
  size_t size() const { return places_.size(); }

 private:
  // 64 ferns, a bit each.
  struct Slice {
    uint64_t valid = 0;     // has depth
    uint64_t code = 0;      // has a code
    uint64_t bits[4] = {};  // of the code
  };
  static std::vector<Slice> sliced(const FernCode& code);

  uint64_t book_hash_ = 0;
  size_t ferns_ = 0;
  std::vector<uint32_t> places_;  // by slot
  std::vector<Slice> slices_;     // by slot, one after the other
};

}  // namespace comap
