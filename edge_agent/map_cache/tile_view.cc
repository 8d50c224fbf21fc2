#include "edge_agent/map_cache/tile_view.h"

#include <algorithm>
#include <cmath>

#include "protocol/types/tile_quantisation.h"

namespace comap {
namespace {

constexpr float kSmallestDisc_px = 0.75f, kLargestDisc_px = 8;
constexpr float kGrazing = 0.08f;  // cosine between view and normal below which a disc tells no depth

// Whether any of a sphere lies in the picture; generous.
bool mayBeSeen(const Eigen::Vector3f& centre, float radius, const CameraModel& k, const TileViewOptions& options) {
  if (centre.z() + radius < options.depth_min_m || centre.z() - radius > options.depth_max_m) return false;
  const auto beyond = [&](float at, double low, double high, double f) {
    // Planes through the optical centre and the picture's sides.
    const auto a = static_cast<float>(low / f), b = static_cast<float>(high / f);
    return at - a * centre.z() < -radius * std::sqrt(1 + a * a) || at - b * centre.z() > radius * std::sqrt(1 + b * b);
  };
  return !beyond(centre.x(), -k.cx - 1, k.width - k.cx, k.fx) && !beyond(centre.y(), -k.cy - 1, k.height - k.cy, k.fy);
}

uint8_t level(float sum, float weight) { return static_cast<uint8_t>(std::clamp(sum / weight + 0.5f, 0.0f, 255.0f)); }

}  // namespace

const TileView& TileRenderer::render(const TileCache& cache, const CameraModel& camera, const Pose& T_map_cam) {
  if (view_.camera.width != camera.width || view_.camera.height != camera.height) {
    view_.depth_m = Image<float>(camera.width, camera.height);
    view_.colour = ColourImage(camera.width, camera.height);
    sums_ = Image<Sum>(camera.width, camera.height);
  }
  view_.camera = camera;
  view_.surfels = 0;
  std::fill(sums_.data(), sums_.data() + sums_.size(), Sum{});
  const Pose T_cam_map = T_map_cam.inverse();
  const Eigen::Matrix3f R = T_cam_map.rotationMatrix().cast<float>();
  for (const auto& [key, tile] : cache.tiles()) {
    if (tile->surfels.empty()) continue;
    // Relative to the tile, so that far from the map's origin nothing is lost in single precision.
    const Eigen::Vector3d corner = Eigen::Vector3d(key.x, key.y, key.z) * double{kTileEdge_m};
    const Eigen::Vector3f t = (T_cam_map * corner).cast<float>();
    const Eigen::Vector3f centre = R * Eigen::Vector3f::Constant(0.5f * kTileEdge_m) + t;
    if (mayBeSeen(centre, 0.9f * kTileEdge_m, camera, options_)) draw(*tile, R, t);
  }
  size_t filled = 0;
  for (size_t i = 0; i < sums_.size(); ++i) {
    const Sum& sum = sums_.data()[i];
    view_.depth_m.data()[i] = sum.weight > 0 ? sum.depth / sum.weight : 0.0f;
    filled += sum.weight > 0;
  }
  fillGaps();
  for (size_t i = 0; i < sums_.size(); ++i) {
    const Sum& sum = sums_.data()[i];
    view_.colour.data()[i] =
        sum.weight > 0 ? Rgb{level(sum.r, sum.weight), level(sum.g, sum.weight), level(sum.b, sum.weight)} : Rgb{};
  }
  view_.filled = static_cast<double>(filled) / static_cast<double>(std::max<size_t>(1, sums_.size()));
  return view_;
}

// Pixels without a surface take the mean colour of the smallest block around them that has one.
void TileRenderer::fillGaps() {
  const auto mean = [](const Sum& sum) {
    return Sum{1, 0, sum.r / sum.weight, sum.g / sum.weight, sum.b / sum.weight};
  };
  halved_.clear();
  halved_.reserve(32);  // `fine` points into it
  for (const Image<Sum>* fine = &sums_; std::min(fine->width(), fine->height()) > 1; fine = &halved_.back()) {
    Image<Sum> half((fine->width() + 1) / 2, (fine->height() + 1) / 2);
    for (int y = 0; y < fine->height(); ++y)
      for (int x = 0; x < fine->width(); ++x) {
        if (fine->at(x, y).weight <= 0) continue;
        const Sum one = mean(fine->at(x, y));
        Sum& sum = half.at(x / 2, y / 2);
        sum = {sum.weight + 1, 0, sum.r + one.r, sum.g + one.g, sum.b + one.b};
      }
    halved_.push_back(std::move(half));
  }
  for (size_t l = halved_.size(); l-- > 0;) {
    Image<Sum>& fine = l > 0 ? halved_[l - 1] : sums_;
    for (int y = 0; y < fine.height(); ++y)
      for (int x = 0; x < fine.width(); ++x)
        if (fine.at(x, y).weight <= 0 && halved_[l].at(x / 2, y / 2).weight > 0)
          fine.at(x, y) = mean(halved_[l].at(x / 2, y / 2));
  }
}

void TileRenderer::draw(const Tile& tile, const Eigen::Matrix3f& R_cam_map, const Eigen::Vector3f& t_cam_map) {
  static const TileKey kAtOrigin{};
  const CameraModel& k = view_.camera;
  const auto fx = static_cast<float>(k.fx), fy = static_cast<float>(k.fy), cx = static_cast<float>(k.cx),
             cy = static_cast<float>(k.cy);
  const float inverse_fx = 1 / fx, inverse_fy = 1 / fy;
  for (const TileSurfel& surfel : tile.surfels) {
    const TileDisc disc = dequantiseDisc(surfel, kAtOrigin);
    const Eigen::Vector3f p = R_cam_map * disc.position + t_cam_map;
    if (p.z() < options_.depth_min_m || p.z() > options_.depth_max_m) continue;
    const float u = fx * p.x() / p.z() + cx, v = fy * p.y() / p.z() + cy;
    if (!(u > -kLargestDisc_px && v > -kLargestDisc_px && u < static_cast<float>(k.width) + kLargestDisc_px &&
          v < static_cast<float>(k.height) + kLargestDisc_px))
      continue;
    const Eigen::Vector3f n = R_cam_map * disc.normal;
    const float distance = n.dot(p);  // of the disc's plane, negative where it faces the camera
    if (-distance < kGrazing * p.norm()) continue;
    ++view_.surfels;
    const float radius = std::max(disc.radius_m, options_.disc_radius_m);
    const float reach = std::clamp(fx * radius / p.z(), kSmallestDisc_px, kLargestDisc_px);
    const int x0 = std::max(0, static_cast<int>(std::ceil(u - reach))),
              x1 = std::min(k.width - 1, static_cast<int>(std::floor(u + reach))),
              y0 = std::max(0, static_cast<int>(std::ceil(v - reach))),
              y1 = std::min(k.height - 1, static_cast<int>(std::floor(v + reach)));
    const float inverse_radius2 = 1 / (radius * radius);
    for (int y = y0; y <= y1; ++y) {
      Sum* row = sums_.row(y);
      const float dy = static_cast<float>(y) - v, my = (static_cast<float>(y) - cy) * inverse_fy;
      for (int x = x0; x <= x1; ++x) {
        const float dx = static_cast<float>(x) - u;
        const float mx = (static_cast<float>(x) - cx) * inverse_fx;
        // Where the pixel's ray meets the disc's plane: on slanted surfaces discs are narrow in the picture, and what
        // is beyond their rim would be seen nearer than it is.
        const float z = distance / (n.x() * mx + n.y() * my + n.z());
        if (!(std::abs(z - p.z()) < options_.blend_m)) continue;
        const float hx = z * mx - p.x(), hy = z * my - p.y(), hz = z - p.z();
        const float inside = 1 - (hx * hx + hy * hy + hz * hz) * inverse_radius2;
        const bool own_pixel = std::abs(dx) <= 0.5f && std::abs(dy) <= 0.5f;
        if (inside <= 0 && !own_pixel) continue;
        Sum& sum = row[x];
        const float weight = inside > 0 ? inside * inside + 0.01f : 0.01f;
        if (sum.weight > 0) {
          const float mean = sum.depth / sum.weight;
          if (z > mean + options_.blend_m) continue;
          if (z < mean - options_.blend_m) sum = Sum{};
        }
        sum.weight += weight;
        sum.depth += weight * z;
        sum.r += weight * static_cast<float>(surfel.r);
        sum.g += weight * static_cast<float>(surfel.g);
        sum.b += weight * static_cast<float>(surfel.b);
      }
    }
  }
}

}  // namespace comap
