#include "mapping_core/surfels/view_bounds.h"

#include <algorithm>
#include <array>

namespace comap {
namespace {

constexpr float kSlack_m = 0.1f;  // surfels move that much by fusion, and float rounding

// Of rays through the image's borders, z = 1.
struct Slopes {
  float left, right, upper, lower;
};

Slopes slopesOf(const FramePush& frame, float margin_px) {
  const auto ends = [&](float size, float centre, float focal) {
    const float a = (-0.5f - margin_px - centre) / focal, b = (size - 0.5f + margin_px - centre) / focal;
    return std::pair(std::min(a, b), std::max(a, b));
  };
  const auto [left, right] = ends(static_cast<float>(frame.width), frame.cx, frame.fx);
  const auto [upper, lower] = ends(static_cast<float>(frame.height), frame.cy, frame.fy);
  return {left, right, upper, lower};
}

}  // namespace

bool mayBeInView(const Eigen::AlignedBox3f& box, const FramePush& frame, float farthest, float margin_px) {
  const Eigen::Map<const Eigen::Matrix<float, 3, 4, Eigen::RowMajor>> T_cam_map(frame.rows);
  const Slopes slopes = slopesOf(frame, margin_px);
  const Eigen::AlignedBox3f slack(box.min().array() - kSlack_m, box.max().array() + kSlack_m);
  // The box is out of view if all its corners are beyond one and the same border.
  std::array<bool, 6> beyond;
  beyond.fill(true);
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3f p =
        T_cam_map * slack.corner(static_cast<Eigen::AlignedBox3f::CornerType>(corner)).homogeneous();
    beyond[0] = beyond[0] && p.z() <= 0;
    beyond[1] = beyond[1] && p.z() >= farthest;
    beyond[2] = beyond[2] && p.x() < slopes.left * p.z();
    beyond[3] = beyond[3] && p.x() > slopes.right * p.z();
    beyond[4] = beyond[4] && p.y() < slopes.upper * p.z();
    beyond[5] = beyond[5] && p.y() > slopes.lower * p.z();
  }
  return std::none_of(beyond.begin(), beyond.end(), [](bool all) { return all; });
}

Eigen::AlignedBox3f viewBounds(const FramePush& frame, float farthest) {
  const Eigen::Map<const Eigen::Matrix<float, 3, 4, Eigen::RowMajor>> T_cam_map(frame.rows);
  const Eigen::Matrix3f R_map_cam = T_cam_map.leftCols<3>().transpose();
  const Eigen::Vector3f centre = -R_map_cam * T_cam_map.col(3);
  const Slopes slopes = slopesOf(frame, 0);
  Eigen::AlignedBox3f box(centre);
  for (const float x : {slopes.left, slopes.right}) {
    for (const float y : {slopes.upper, slopes.lower}) {
      box.extend(centre + R_map_cam * Eigen::Vector3f(x, y, 1) * farthest);
    }
  }
  return box;
}

}  // namespace comap
