// Whether depth lies where colour says it should: edges of things are edges in both.
#pragma once

#include <vector>

#include "protocol/types/image.h"

namespace comap {

struct EdgeAgreement {
  static constexpr int kReach = 8;  ///< pixels that are searched in each direction
  size_t edges = 0;                 ///< pixels at which depth jumps by more than 5 %
  double offset_x_px = 0;           ///< depth has to move by this much to lie best on the edges of the colour picture
  double offset_y_px = 0;
  bool out_of_reach = false;  ///< the best offset lies at the border of what is searched: the true one may be larger
  double contrast = 0;        ///< brightness edges under depth edges at that offset, of what they are 8 pixels around
  bool determined() const;    ///< enough edges, in both directions, that stand out
  bool agrees() const;        ///< determined, and no more than 1.5 pixels off
  double distance_px() const;
};

/// Sums over frames of one camera. Thread rule: one thread.
class EdgeComparison {
 public:
  void add(const Frame& frame);
  EdgeAgreement result() const;

 private:
  static constexpr int kReach = EdgeAgreement::kReach, kSide = 2 * kReach + 1;
  struct Sums {
    size_t edges = 0;
    std::vector<double> strength = std::vector<double>(kSide * kSide);
  };
  Sums across_, down_;  // edges that run down, seen going across, and the other way round
};

/// The frame in grey with its depth edges on it: green where the picture has an edge within a pixel, red where not.
ColourImage drawEdges(const Frame& frame);

}  // namespace comap
