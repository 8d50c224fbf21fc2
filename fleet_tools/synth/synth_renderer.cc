#include "fleet_tools/synth/synth_renderer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "fleet_tools/synth/scene_bvh.h"
#include "fleet_tools/synth/synth_parallel.h"

namespace comap {
namespace {

using Eigen::Matrix3f;
using Eigen::Vector3f;

constexpr int kTile = 16;
constexpr float kNever = std::numeric_limits<float>::infinity();
constexpr float kNear_m = 0.05f;

// All rays of a row start at one point, and direction is linear along the row: the loop over pixels vectorises.
void enterBoxRow(const Vector3f& half, const Vector3f& o, const Vector3f& d0, const Vector3f& step, int count,
                 int32_t index, float* depth, int32_t* primitive) {
  const float lx = -half.x() - o.x(), hx = half.x() - o.x(), ly = -half.y() - o.y(), hy = half.y() - o.y();
  const float lz = -half.z() - o.z(), hz = half.z() - o.z();
  for (int i = 0; i < count; ++i) {
    const float s = static_cast<float>(i);
    const float ix = 1 / (d0.x() + s * step.x()), iy = 1 / (d0.y() + s * step.y()), iz = 1 / (d0.z() + s * step.z());
    const float ax = lx * ix, bx = hx * ix, ay = ly * iy, by = hy * iy, az = lz * iz, bz = hz * iz;
    const float nx = ax < bx ? ax : bx, fx = ax < bx ? bx : ax, ny = ay < by ? ay : by, fy = ay < by ? by : ay;
    const float nz = az < bz ? az : bz, fz = az < bz ? bz : az;
    float near = nx > ny ? nx : ny, far = fx < fy ? fx : fy;
    near = near > nz ? near : nz;
    far = far < fz ? far : fz;
    const bool hit = (near <= far) & (near > 0) & (near < depth[i]);
    depth[i] = hit ? near : depth[i];
    primitive[i] = hit ? index : primitive[i];
  }
}

}  // namespace

// Where a solid can be in the picture, conservatively.
struct SynthRenderer::Projected {
  int primitive = 0;
  float nearest_m = 0;
  float x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

struct SynthRenderer::Rays {
  CameraModel camera;
  Vector3f origin;
  Matrix3f R_world_cam;

  // With z = 1 in the camera, so that the ray's parameter is the depth.
  Vector3f direction(float u, float v) const {
    return R_world_cam * Vector3f((u - static_cast<float>(camera.cx)) / static_cast<float>(camera.fx),
                                  (v - static_cast<float>(camera.cy)) / static_cast<float>(camera.fy), 1);
  }
};

SynthRenderer::SynthRenderer(const Scene& scene, int threads)
    : scene_(scene),
      threads_(std::max(1, threads)),
      textures_(makeTextures(scene.seed, threads_)),
      light_(scene, threads_) {}

SynthView SynthRenderer::render(const CameraModel& camera, const Pose& T_world_cam) const {
  SynthView view{ColourImage(camera.width, camera.height), Image<float>(camera.width, camera.height, kNever),
                 Image<float>(camera.width, camera.height), Image<int32_t>(camera.width, camera.height, -1)};
  const Rays rays{camera, T_world_cam.translation().cast<float>(), T_world_cam.rotationMatrix().cast<float>()};

  std::vector<Projected> projected;
  for (size_t i = 0; i < scene_.primitives.size(); ++i) {
    const auto& primitive = scene_.primitives[i];
    Projected p{static_cast<int>(i), kNever, kNever, kNever, -kNever, -kNever};
    float farthest = -kNever;
    bool behind = false;
    for (int corner = 0; corner < 8; ++corner) {
      const Vector3f sign(corner & 1 ? 1.0f : -1.0f, corner & 2 ? 1.0f : -1.0f, corner & 4 ? 1.0f : -1.0f);
      const Vector3f world = primitive.centre + primitive.R_local_world.transpose() * sign.cwiseProduct(primitive.half);
      const Vector3f x = rays.R_world_cam.transpose() * (world - rays.origin);
      p.nearest_m = std::min(p.nearest_m, x.z());
      farthest = std::max(farthest, x.z());
      if (x.z() < kNear_m) {
        behind = true;
        continue;
      }
      const Eigen::Vector2d pixel = camera.project(x.cast<double>());
      const float u = static_cast<float>(pixel.x()), v = static_cast<float>(pixel.y());
      p.x0 = std::min(p.x0, u - 1), p.x1 = std::max(p.x1, u + 1);
      p.y0 = std::min(p.y0, v - 1), p.y1 = std::max(p.y1, v + 1);
    }
    if (farthest <= 0) continue;
    if (behind) p = {p.primitive, p.nearest_m, -kNever, -kNever, kNever, kNever};
    projected.push_back(p);
  }
  std::sort(projected.begin(), projected.end(), [](const Projected& a, const Projected& b) {
    return a.nearest_m < b.nearest_m || (a.nearest_m == b.nearest_m && a.primitive < b.primitive);
  });

  const int tiles = ((camera.width + kTile - 1) / kTile) * ((camera.height + kTile - 1) / kTile);
  parallelFor(tiles, threads_, [&](int tile) { traceTile(rays, projected, tile, view); });
  parallelFor(camera.height, threads_, [&](int y) { shadeRow(rays, y, view); });
  for (size_t i = 0; i < view.depth_m.size(); ++i) {
    if (view.primitive.data()[i] < 0) view.depth_m.data()[i] = 0;
  }
  return view;
}

void SynthRenderer::traceTile(const Rays& rays, const std::vector<Projected>& projected, int tile,
                              SynthView& view) const {
  const int per_row = (rays.camera.width + kTile - 1) / kTile;
  const int x0 = tile % per_row * kTile, y0 = tile / per_row * kTile;
  const int width = std::min(kTile, rays.camera.width - x0), height = std::min(kTile, rays.camera.height - y0);
  float depth[kTile][kTile];
  int32_t primitive[kTile][kTile];
  for (auto& row : depth) std::fill(row, row + kTile, kNever);
  for (auto& row : primitive) std::fill(row, row + kTile, -1);

  const float left = static_cast<float>(x0), top = static_cast<float>(y0);
  const float right = static_cast<float>(x0 + width - 1), bottom = static_cast<float>(y0 + height - 1);
  const Vector3f corner = rays.direction(left, top);
  const Vector3f step_u = rays.R_world_cam.col(0) / static_cast<float>(rays.camera.fx);
  const Vector3f step_v = rays.R_world_cam.col(1) / static_cast<float>(rays.camera.fy);
  float farthest = kNever;
  int since_check = 0;
  for (const auto& p : projected) {
    if (p.nearest_m >= farthest) break;
    if (p.x1 < left || p.x0 > right || p.y1 < top || p.y0 > bottom) continue;
    const auto& solid = scene_.primitives[static_cast<size_t>(p.primitive)];
    const Vector3f o = solid.R_local_world * (rays.origin - solid.centre);
    const Vector3f d = solid.R_local_world * corner, du = solid.R_local_world * step_u;
    const Vector3f dv = solid.R_local_world * step_v;
    for (int y = 0; y < height; ++y) {
      const Vector3f row = d + static_cast<float>(y) * dv;
      if (solid.shape == Shape::kBox) {
        enterBoxRow(solid.half, o, row, du, width, p.primitive, depth[y], primitive[y]);
        continue;
      }
      for (int x = 0; x < width; ++x) {
        const float t = enter(solid.shape, solid.half, o, row + static_cast<float>(x) * du);
        if (t < depth[y][x]) {
          depth[y][x] = t;
          primitive[y][x] = p.primitive;
        }
      }
    }
    if (++since_check % 4 != 0) continue;
    farthest = 0;
    for (int y = 0; y < height; ++y) farthest = std::max(farthest, *std::max_element(depth[y], depth[y] + width));
  }
  for (int y = 0; y < height; ++y) {
    std::copy(depth[y], depth[y] + width, view.depth_m.row(y0 + y) + x0);
    std::copy(primitive[y], primitive[y] + width, view.primitive.row(y0 + y) + x0);
  }
}

Vector3f SynthRenderer::shade(int index, const Vector3f& origin, const Vector3f& direction, float depth_m, float pixel,
                              float* cosine) const {
  const auto& primitive = scene_.primitives[static_cast<size_t>(index)];
  const Vector3f local = primitive.R_local_world * (origin + depth_m * direction - primitive.centre);
  const SurfaceSpot spot = spotAt(primitive, local);
  const Vector3f ray = primitive.R_local_world * direction;
  const float facing = std::max(0.02f, -spot.normal_local.dot(ray) / ray.norm());
  if (cosine != nullptr) *cosine = facing;
  const auto& texture = textures_[static_cast<size_t>(primitive.texture)];
  const float per_a = primitive.fit ? 1 : spot.size_a / texture.edge_m();
  const float per_b = primitive.fit ? 1 : spot.size_b / texture.edge_m();
  const float footprint_m = depth_m * pixel / std::sqrt(facing);
  const float footprint = footprint_m * std::max(per_a / spot.size_a, per_b / spot.size_b);
  const Vector3f albedo =
      texture.sample(spot.a * per_a + primitive.shift.x(), spot.b * per_b + primitive.shift.y(), footprint);
  return albedo.cwiseProduct(primitive.tint) * (255 * light_.at(index, spot));
}

void SynthRenderer::shadeRow(const Rays& rays, int y, SynthView& view) const {
  const float pixel = 1 / static_cast<float>(rays.camera.fx);
  const int width = rays.camera.width, height = rays.camera.height;
  for (int x = 0; x < width; ++x) {
    // The solids at and around this pixel; more than one makes it an edge.
    std::array<int32_t, 9> around;
    size_t count = 0;
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const int nx = std::clamp(x + dx, 0, width - 1), ny = std::clamp(y + dy, 0, height - 1);
        const int32_t index = view.primitive.at(nx, ny);
        if (index >= 0 && std::find(around.begin(), around.begin() + count, index) == around.begin() + count) {
          around[count++] = index;
        }
      }
    }
    Vector3f colour = Vector3f::Zero();
    const int32_t centre = view.primitive.at(x, y);
    if (centre >= 0) {
      const Vector3f direction = rays.direction(static_cast<float>(x), static_cast<float>(y));
      colour = shade(centre, rays.origin, direction, view.depth_m.at(x, y), pixel, &view.cosine.at(x, y));
    }
    if (count > 1) {
      // Each solid is shaded once, and weighs as many of the four rays through the pixel's quarters as it stops.
      std::array<Vector3f, 9> shaded;
      std::array<bool, 9> known{};
      for (size_t i = 0; i < count; ++i) {
        if (around[i] == centre) shaded[i] = colour, known[i] = true;
      }
      colour.setZero();
      for (int sub = 0; sub < 4; ++sub) {
        const Vector3f direction = rays.direction(static_cast<float>(x) + (sub % 2 == 0 ? -0.25f : 0.25f),
                                                  static_cast<float>(y) + (sub / 2 == 0 ? -0.25f : 0.25f));
        float nearest = kNever;
        size_t hit = count;
        for (size_t i = 0; i < count; ++i) {
          const auto& solid = scene_.primitives[static_cast<size_t>(around[i])];
          const float t = enter(solid.shape, solid.half, solid.R_local_world * (rays.origin - solid.centre),
                                solid.R_local_world * direction);
          if (t < nearest) nearest = t, hit = i;
        }
        if (hit == count) continue;
        if (!known[hit]) shaded[hit] = shade(around[hit], rays.origin, direction, nearest, pixel, nullptr);
        known[hit] = true;
        colour += 0.25f * shaded[hit];
      }
    }
    const Vector3f level = colour.array().max(0.0f).min(255.0f) + 0.5f;
    view.colour.at(x, y) = {static_cast<uint8_t>(level[0]), static_cast<uint8_t>(level[1]),
                            static_cast<uint8_t>(level[2])};
  }
}

Vector3f SynthRenderer::normalAt(int index, const Vector3f& point) const {
  const auto& primitive = scene_.primitives[static_cast<size_t>(index)];
  const Vector3f local = primitive.R_local_world * (point - primitive.centre);
  return primitive.R_local_world.transpose() * spotAt(primitive, local).normal_local;
}

}  // namespace comap
