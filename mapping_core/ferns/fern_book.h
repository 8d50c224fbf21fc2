// The ferns all robots share: where to look and which thresholds to apply (randomised ferns; Glocker et al. 2015, used
// across maps by Gallagher & McDonald, "Collaborative Dense SLAM"). Drawn from one seed; its hash travels with every
// code, because codes of different books are never comparable and nothing else would tell.
#pragma once

#include <cstdint>
#include <vector>

namespace comap {

inline constexpr int kFernImageWidth = 80;
inline constexpr int kFernImageHeight = 60;

struct Fern {
  int x = 0, y = 0;             ///< pixel of the 80x60 image
  uint8_t r = 0, g = 0, b = 0;  ///< thresholds after brightness normalisation
  uint16_t depth_mm = 0;
};

class FernBook {
 public:
  static constexpr uint32_t kStandardSeed = 0x5EED;
  /// The book of all robots of a core: 500 ferns, depth thresholds 0.4 to 5 m.
  static FernBook standard(uint64_t seed = kStandardSeed) { return FernBook(seed, 500, 400, 5000); }

  FernBook(uint64_t seed, int count, uint16_t depth_min_mm, uint16_t depth_max_mm);

  const std::vector<Fern>& ferns() const { return ferns_; }
  uint64_t hash() const { return hash_; }

 private:
  std::vector<Fern> ferns_;
  uint64_t hash_ = 0;
};

}  // namespace comap
