// Which keyframes look like this one: inverted lists over fern codes.
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

  /// The `count` most similar places that `admit` lets pass, most similar first; ties by lower number.
  std::vector<PlaceCandidate> query(const FernCode& code, size_t count,
                                    const std::function<bool(uint32_t place)>& admit) const;
  size_t size() const { return places_.size(); }

 private:
  uint64_t book_hash_ = 0;
  std::vector<uint32_t> places_;                           // by slot
  std::vector<FernCode> codes_;                            // by slot
  std::vector<std::vector<std::vector<uint32_t>>> slots_;  // [fern][code] -> slots
};

}  // namespace comap
