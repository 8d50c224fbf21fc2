// Where the surfels of a chunk lie, as some boxes: a chunk that holds what robots in two places have just seen is in
// view from neither of the places between.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "mapping_core/surfels/push_constants.h"

namespace comap {

class ChunkBounds {
 public:
  void extend(const Eigen::AlignedBox3f& box);
  void extend(const ChunkBounds& other);
  /// Position and confidence of each row; gaps (confidence below 0) lie nowhere.
  void extend(const std::vector<std::array<float, 4>>& places);
  /// See mayBeInView() of view_bounds.h.
  bool mayBeInView(const FramePush& frame, float farthest, float margin_px) const;
  size_t parts() const { return parts_.size(); }

 private:
  std::vector<Eigen::AlignedBox3f> parts_;
};

}  // namespace comap
