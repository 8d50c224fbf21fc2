#include "fleet_tools/synth/scene_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace comap {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;

constexpr float kPi = 3.14159265f;
constexpr float kNever = std::numeric_limits<float>::infinity();

// The two axes across a box face, so that the second is up wherever there is an up.
constexpr int kAcross[3][2] = {{1, 2}, {0, 2}, {0, 1}};

float enterBox(const Vector3f& half, const Vector3f& o, const Vector3f& d) {
  float near = -kNever, far = kNever;
  for (int k = 0; k < 3; ++k) {
    const float inverse = 1 / d[k];
    const float t0 = (-half[k] - o[k]) * inverse, t1 = (half[k] - o[k]) * inverse;
    near = std::max(near, std::min(t0, t1));
    far = std::min(far, std::max(t0, t1));
  }
  return near <= far && near > 0 ? near : kNever;
}

float enterEllipsoid(const Vector3f& half, const Vector3f& o, const Vector3f& d) {
  const Vector3f p = o.cwiseQuotient(half), q = d.cwiseQuotient(half);
  const float a = q.squaredNorm(), b = p.dot(q), c = p.squaredNorm() - 1;
  const float root = b * b - a * c;
  if (root < 0) return kNever;
  const float t = (-b - std::sqrt(root)) / a;
  return t > 0 ? t : kNever;
}

float enterCylinder(const Vector3f& half, const Vector3f& o, const Vector3f& d) {
  float near = -kNever, far = kNever;
  const float a = d.x() * d.x() + d.y() * d.y(), b = o.x() * d.x() + o.y() * d.y();
  const float c = o.x() * o.x() + o.y() * o.y() - half.x() * half.x();
  if (a > 1e-12f) {
    const float root = b * b - a * c;
    if (root < 0) return kNever;
    near = (-b - std::sqrt(root)) / a;
    far = (-b + std::sqrt(root)) / a;
  } else if (c > 0) {
    return kNever;
  }
  const float inverse = 1 / d.z();
  const float t0 = (-half.z() - o.z()) * inverse, t1 = (half.z() - o.z()) * inverse;
  near = std::max(near, std::min(t0, t1));
  far = std::min(far, std::max(t0, t1));
  return near <= far && near > 0 ? near : kNever;
}

}  // namespace

int faceCount(Shape shape) { return shape == Shape::kBox ? 6 : shape == Shape::kCylinder ? 3 : 1; }

Vector2f sizeOf(const Primitive& primitive, int face) {
  const Vector3f& half = primitive.half;
  switch (primitive.shape) {
    case Shape::kBox:
      return {2 * half[kAcross[face / 2][0]], 2 * half[kAcross[face / 2][1]]};
    case Shape::kCylinder:
      return face == 0 ? Vector2f(2 * kPi * half.x(), 2 * half.z()) : Vector2f(2 * half.x(), 2 * half.x());
    default:
      return {2 * kPi * half.head<2>().maxCoeff(), kPi * half.maxCoeff()};
  }
}

SurfaceSpot spotAt(const Primitive& primitive, const Vector3f& p) {
  SurfaceSpot spot;
  const Vector3f& half = primitive.half;
  if (primitive.shape == Shape::kBox) {
    int k = 0;
    const Vector3f inside = half - p.cwiseAbs();
    if (inside[1] < inside[k]) k = 1;
    if (inside[2] < inside[k]) k = 2;
    spot.face = 2 * k + (p[k] > 0 ? 1 : 0);
    spot.a = 0.5f + 0.5f * p[kAcross[k][0]] / half[kAcross[k][0]];
    spot.b = 0.5f + 0.5f * p[kAcross[k][1]] / half[kAcross[k][1]];
    spot.normal_local.setZero();
    spot.normal_local[k] = p[k] > 0 ? 1.0f : -1.0f;
  } else if (primitive.shape == Shape::kEllipsoid) {
    const Vector3f unit = p.cwiseQuotient(half);
    spot.a = 0.5f + std::atan2(unit.y(), unit.x()) / (2 * kPi);
    spot.b = 1 - std::acos(std::clamp(unit.z(), -1.0f, 1.0f)) / kPi;
    spot.normal_local = unit.cwiseQuotient(half).normalized();
  } else {
    const float radius = p.head<2>().norm();
    if (half.z() - std::abs(p.z()) < half.x() - radius) {
      spot.face = p.z() > 0 ? 1 : 2;
      spot.a = 0.5f + 0.5f * p.x() / half.x();
      spot.b = 0.5f + 0.5f * p.y() / half.x();
      spot.normal_local = {0, 0, p.z() > 0 ? 1.0f : -1.0f};
    } else {
      spot.a = 0.5f + std::atan2(p.y(), p.x()) / (2 * kPi);
      spot.b = 0.5f + 0.5f * p.z() / half.z();
      spot.normal_local = {p.x() / radius, p.y() / radius, 0};
    }
  }
  const Vector2f size = sizeOf(primitive, spot.face);
  spot.size_a = size.x();
  spot.size_b = size.y();
  return spot;
}

Vector3f pointOf(const Primitive& primitive, int face, float a, float b, Vector3f& normal) {
  const Vector3f& half = primitive.half;
  if (primitive.shape == Shape::kBox) {
    const int k = face / 2;
    const float sign = face % 2 == 0 ? -1.0f : 1.0f;
    Vector3f p;
    p[k] = sign * half[k];
    p[kAcross[k][0]] = (2 * a - 1) * half[kAcross[k][0]];
    p[kAcross[k][1]] = (2 * b - 1) * half[kAcross[k][1]];
    normal.setZero();
    normal[k] = sign;
    return p;
  }
  const float angle = (a - 0.5f) * 2 * kPi;
  if (primitive.shape == Shape::kEllipsoid) {
    const float polar = (1 - b) * kPi;
    const Vector3f unit(std::cos(angle) * std::sin(polar), std::sin(angle) * std::sin(polar), std::cos(polar));
    normal = unit.cwiseQuotient(half).normalized();
    return unit.cwiseProduct(half);
  }
  if (face == 0) {
    normal = {std::cos(angle), std::sin(angle), 0};
    return {half.x() * normal.x(), half.x() * normal.y(), (2 * b - 1) * half.z()};
  }
  const float sign = face == 1 ? 1.0f : -1.0f;
  normal = {0, 0, sign};
  return {(2 * a - 1) * half.x(), (2 * b - 1) * half.x(), sign * half.z()};
}

float enter(Shape shape, const Vector3f& half, const Vector3f& origin, const Vector3f& direction) {
  switch (shape) {
    case Shape::kBox:
      return enterBox(half, origin, direction);
    case Shape::kEllipsoid:
      return enterEllipsoid(half, origin, direction);
    default:
      return enterCylinder(half, origin, direction);
  }
}

}  // namespace comap
