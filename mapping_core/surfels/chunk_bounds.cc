#include "mapping_core/surfels/chunk_bounds.h"

#include <algorithm>

#include "mapping_core/surfels/view_bounds.h"

namespace comap {
namespace {

// Boxes are joined up to this diagonal: some more than what one keyframe sees, so that there are few.
constexpr float kPart_m = 12;

// Rows made one after the other lie near each other.
constexpr size_t kRowsTogether = 64;

}  // namespace

void ChunkBounds::extend(const Eigen::AlignedBox3f& box) {
  if (box.isEmpty()) return;
  const auto near = std::find_if(parts_.begin(), parts_.end(), [&](const Eigen::AlignedBox3f& part) {
    return part.contains(box) || part.merged(box).diagonal().norm() <= kPart_m;
  });
  if (near == parts_.end()) {
    parts_.push_back(box);
  } else {
    near->extend(box);
  }
}

void ChunkBounds::extend(const ChunkBounds& other) {
  for (const auto& part : other.parts_) extend(part);
}

void ChunkBounds::extend(const std::vector<std::array<float, 4>>& places) {
  for (size_t first = 0; first < places.size(); first += kRowsTogether) {
    Eigen::AlignedBox3f box;
    for (size_t i = first; i < std::min(first + kRowsTogether, places.size()); ++i) {
      const auto& place = places[i];
      if (place[3] >= 0) box.extend(Eigen::Vector3f(place[0], place[1], place[2]));
    }
    extend(box);
  }
}

bool ChunkBounds::mayBeInView(const FramePush& frame, float farthest, float margin_px) const {
  return std::any_of(parts_.begin(), parts_.end(), [&](const Eigen::AlignedBox3f& part) {
    return comap::mayBeInView(part, frame, farthest, margin_px);
  });
}

}  // namespace comap
