// The places that a robot remembers: for each keyframe its pose, its fern code and a small picture; bounded.
#pragma once

#include <cstdint>
#include <vector>

#include "mapping_core/ferns/place_index.h"
#include "mapping_core/rgbd/pyramid.h"
#include "protocol/types/keyframe.h"
#include "protocol/types/pose.h"

namespace comap {

/// The pyramid level that is kept (160x120 of a 640x480 camera, 58 kB); one coarser level is made from it.
inline constexpr int kPlaceLevel = 2;

struct RememberedPlace {
  uint32_t sequence = 0;
  Pose T_odom_keyframe;
  FernCode code;
  CameraModel camera;     ///< of the small picture
  Image<uint8_t> grey;    ///< rounded
  Image<uint16_t> depth;  ///< in the project's unit (0.2 mm), 0 = none

  /// Levels kPlaceLevel and kPlaceLevel + 1; the finer ones are empty.
  Pyramid pyramid() const;
};

/// Thread rule: one thread.
class PlaceMemory {
 public:
  /// At most `capacity` places, at least 1.
  explicit PlaceMemory(size_t capacity) : capacity_(capacity) {}

  /// Remembers a keyframe. Beyond the capacity, one of the two places whose codes are most alike is forgotten, the
  /// newer one, which may be this: where the robot stays or passes slowly the memory thins out, and it keeps the first
  /// view, whose pose has drifted least. False if the keyframe is not remembered: for that reason, or because it cannot
  /// be recognised (depth in less than a tenth of the ferns or of the picture, fewer than kPlaceLevel + 2 levels,
  /// ferns of another book, a sequence that is there already).
  bool add(uint32_t sequence, const Pose& T_odom_keyframe, const FernCode& code, const Pyramid& pyramid);

  /// The `count` places most like `code`, none farther than `max_dissimilarity`, the most similar first; `place` is the
  /// index for at().
  std::vector<PlaceCandidate> similar(const FernCode& code, size_t count, double max_dissimilarity) const;

  const RememberedPlace& at(uint32_t place) const { return places_[place]; }
  size_t size() const { return places_.size(); }
  void clear();

 private:
  struct Neighbour {
    double dissimilarity = 1;
    uint32_t sequence = 0;
  };
  Neighbour nearestTo(size_t place) const;
  size_t mostRedundant() const;
  void forget(size_t place);

  size_t capacity_;
  std::vector<RememberedPlace> places_;  // in the order of adding
  std::vector<Neighbour> nearest_;       // of each place, among all others
};

}  // namespace comap
