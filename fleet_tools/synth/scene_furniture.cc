#include "fleet_tools/synth/scene_furniture.h"

#include <algorithm>
#include <cmath>

namespace comap {
namespace {

using Eigen::Vector3f;

Eigen::Matrix3f turned(float yaw_deg) {
  const float a = yaw_deg * 3.14159265f / 180;
  Eigen::Matrix3f rotation;  // rows: the local axes in the world
  rotation << std::cos(a), std::sin(a), 0, -std::sin(a), std::cos(a), 0, 0, 0, 1;
  return rotation;
}

float mixSpan(float a, float b, float s) { return a + (b - a) * s; }

bool alongX(Facing facing) { return facing == Facing::kNorth || facing == Facing::kSouth; }

}  // namespace

Vector3f Furnisher::colour(float low, float high) {
  const float r = random_.uniform(low, high), g = random_.uniform(low, high), b = random_.uniform(low, high);
  return {r, g, b};
}

Primitive& Furnisher::box(const Span& s, const Finish& finish) {
  return turnedBox({(s.x0 + s.x1) / 2, (s.y0 + s.y1) / 2, (s.z0 + s.z1) / 2},
                   {(s.x1 - s.x0) / 2, (s.y1 - s.y0) / 2, (s.z1 - s.z0) / 2}, 0, finish);
}

Primitive& Furnisher::turnedBox(const Vector3f& centre, const Vector3f& half, float yaw_deg, const Finish& finish) {
  Primitive primitive;
  primitive.shape = Shape::kBox;
  primitive.centre = centre + origin_;
  primitive.half = half;
  if (yaw_deg != 0) primitive.R_local_world = turned(yaw_deg);
  primitive.texture = finish.texture;
  primitive.tint = finish.tint;
  primitive.fit = finish.fit;
  if (!finish.fit) primitive.shift = {random_.uniform(0, 1), random_.uniform(0, 1)};
  scene_.primitives.push_back(primitive);
  return scene_.primitives.back();
}

Primitive& Furnisher::ellipsoid(const Vector3f& centre, const Vector3f& radii, const Finish& finish) {
  auto& primitive = turnedBox(centre, radii, 0, finish);
  primitive.shape = Shape::kEllipsoid;
  return primitive;
}

Primitive& Furnisher::cylinder(const Vector3f& base, float radius, float height, const Finish& finish) {
  auto& primitive = turnedBox(base + Vector3f(0, 0, height / 2), {radius, radius, height / 2}, 0, finish);
  primitive.shape = Shape::kCylinder;
  return primitive;
}

void Furnisher::bookshelf(const Span& s, Facing facing, int rows) {
  const Finish board{kWood, colour(0.7f, 0.95f)};
  constexpr float kBoard = 0.025f;
  const bool wide_x = alongX(facing);
  const float length = wide_x ? s.x1 - s.x0 : s.y1 - s.y0, depth = wide_x ? s.y1 - s.y0 : s.x1 - s.x0;
  // l along the shelf, d from the back to the front.
  const auto place = [&](float l0, float l1, float d0, float d1, float z0, float z1) {
    const bool flipped = facing == Facing::kSouth || facing == Facing::kWest;
    if (flipped) {
      const float t = d0;
      d0 = depth - d1;
      d1 = depth - t;
    }
    return wide_x ? Span{s.x0 + l0, s.y0 + d0, z0, s.x0 + l1, s.y0 + d1, z1}
                  : Span{s.x0 + d0, s.y0 + l0, z0, s.x0 + d1, s.y0 + l1, z1};
  };
  box(place(0, length, 0, 0.02f, s.z0, s.z1), {kDarkWood, Vector3f::Ones()});
  box(place(0, kBoard, 0, depth, s.z0, s.z1), board);
  box(place(length - kBoard, length, 0, depth, s.z0, s.z1), board);
  const float pitch = (s.z1 - s.z0 - kBoard) / static_cast<float>(rows);
  for (int row = 0; row <= rows; ++row) {
    const float z = s.z0 + pitch * static_cast<float>(row);
    box(place(kBoard, length - kBoard, 0, depth, z, z + kBoard), board);
    if (row == rows) break;
    float l = kBoard + 0.005f;
    const float end = length - kBoard - 0.005f, room = pitch - kBoard;
    while (l < end - 0.06f) {
      if (random_.uniform(0, 1) < 0.07f) {
        const float r = std::min(0.5f * (end - l), random_.uniform(0.05f, 0.08f));
        const Span cell = place(l, l + 2 * r, depth / 2 - r, depth / 2 + r, z + kBoard, z + kBoard + 2 * r);
        const Vector3f middle(cell.x0 + r, cell.y0 + r, cell.z0 + r);
        if (random_.below(2) == 0) {
          ellipsoid(middle, {r, r, r}, {kMarble, colour(0.4f, 1)});
        } else {
          cylinder(middle - Vector3f(0, 0, r), 0.8f * r, 2 * r, {kStripes, colour(0.4f, 1)});
        }
        l += 2 * r + 0.01f;
        continue;
      }
      const float width = std::min(end - l, random_.uniform(0.024f, 0.062f));
      const float height = room * random_.uniform(0.6f, 0.95f);
      Finish cover{kBook, colour(0.08f, 0.95f), true};
      box(place(l, l + width, 0.03f, depth - random_.uniform(0.015f, 0.06f), z + kBoard, z + kBoard + height), cover);
      l += width + 0.001f;
      if (random_.uniform(0, 1) < 0.08f) l += random_.uniform(0.03f, 0.1f);
    }
  }
}

void Furnisher::table(const Span& s, const Finish& top, float leg) {
  constexpr float kTop = 0.04f;
  box({s.x0, s.y0, s.z1 - kTop, s.x1, s.y1, s.z1}, top);
  for (int i = 0; i < 4; ++i) {
    const float x = i % 2 == 0 ? s.x0 + 0.03f : s.x1 - 0.03f - leg, y = i / 2 == 0 ? s.y0 + 0.03f : s.y1 - 0.03f - leg;
    box({x, y, s.z0, x + leg, y + leg, s.z1 - kTop}, {kDarkWood, Vector3f::Ones()});
  }
}

void Furnisher::chair(float x, float y, float yaw_deg, const Finish& finish) {
  const Eigen::Matrix3f axes = turned(yaw_deg).transpose();
  const auto part = [&](const Vector3f& centre, const Vector3f& half, const Finish& f) {
    turnedBox(Vector3f(x, y, 0) + axes * centre, half, yaw_deg, f);
  };
  part({0, 0, 0.45f}, {0.21f, 0.21f, 0.025f}, finish);
  part({-0.19f, 0, 0.76f}, {0.02f, 0.2f, 0.16f}, finish);
  for (int i = 0; i < 4; ++i) {
    const float lx = i % 2 == 0 ? -0.185f : 0.185f, ly = i / 2 == 0 ? -0.18f : 0.18f;
    const float height = i % 2 == 0 ? 0.3f : 0.2125f;
    part({lx, ly, height}, {0.02f, 0.02f, height}, {kDarkWood, Vector3f::Ones()});
  }
}

void Furnisher::sofa(const Span& s, Facing facing, const Vector3f& tint) {
  const Finish cloth{kFabric, tint};
  const float seat = s.z0 + 0.42f;
  Span base = s, back = s, arm0 = s, arm1 = s;
  base.z1 = seat;
  const float arm_top = s.z0 + 0.6f;
  arm0.z1 = arm1.z1 = arm_top;
  if (alongX(facing)) {
    (facing == Facing::kNorth ? back.y1 : back.y0) = facing == Facing::kNorth ? s.y0 + 0.22f : s.y1 - 0.22f;
    arm0.x1 = s.x0 + 0.18f;
    arm1.x0 = s.x1 - 0.18f;
  } else {
    (facing == Facing::kEast ? back.x1 : back.x0) = facing == Facing::kEast ? s.x0 + 0.22f : s.x1 - 0.22f;
    arm0.y1 = s.y0 + 0.18f;
    arm1.y0 = s.y1 - 0.18f;
  }
  for (const Span& part : {base, back, arm0, arm1}) box(part, cloth);
  // Cushions against the back, each turned a little.
  for (int i = 0; i < 3; ++i) {
    const float along = 0.24f + 0.26f * static_cast<float>(i) + random_.uniform(-0.04f, 0.04f);
    const float x = alongX(facing) ? s.x0 + along * (s.x1 - s.x0) : (s.x0 + s.x1) / 2;
    const float y = alongX(facing) ? (s.y0 + s.y1) / 2 : s.y0 + along * (s.y1 - s.y0);
    turnedBox({x, y, seat + 0.17f}, {0.19f, 0.08f, 0.17f}, (alongX(facing) ? 0 : 90) + random_.uniform(-25, 25),
              {i % 2 == 0 ? kQuilt : kStripes, colour(0.5f, 1.1f), i % 2 == 0});
  }
}

void Furnisher::bed(const Span& s) {
  box({s.x0, s.y0, s.z0, s.x1, s.y1, s.z0 + 0.28f}, {kWood, Vector3f::Ones()});
  box({s.x0 + 0.03f, s.y0 + 0.03f, s.z0 + 0.28f, s.x1 - 0.03f, s.y1 - 0.03f, s.z0 + 0.48f},
      {kFabric, {1.3f, 1.3f, 1.2f}});
  box({s.x0 - 0.02f, s.y0 - 0.02f, s.z0 + 0.2f, s.x1 + 0.02f, s.y1 - 0.6f, s.z0 + 0.53f}, {kQuilt, Vector3f::Ones()});
  box({s.x0 - 0.04f, s.y1, s.z0, s.x1 + 0.04f, s.y1 + 0.05f, s.z0 + 1.05f}, {kDarkWood, Vector3f::Ones()});
  for (int i = 0; i < 2; ++i) {
    const float x = s.x0 + (s.x1 - s.x0) * (0.27f + 0.46f * static_cast<float>(i));
    ellipsoid({x, s.y1 - 0.3f, s.z0 + 0.54f}, {0.32f, 0.2f, 0.11f}, {kStripes, {1.1f, 1.1f, 1.15f}});
  }
}

void Furnisher::wardrobe(const Span& s, Facing facing) {
  box(s, {kWood, {0.95f, 0.85f, 0.8f}});
  const int doors = 3;
  for (int i = 0; i < doors; ++i) {
    const float a = (static_cast<float>(i) + 0.03f) / doors, b = (static_cast<float>(i) + 0.97f) / doors;
    Span door = s, handle = s;
    door.z0 += 0.08f;
    door.z1 -= 0.05f;
    handle.z0 = s.z0 + 0.95f;
    handle.z1 = s.z0 + 1.15f;
    if (alongX(facing)) {
      const float front = facing == Facing::kNorth ? s.y1 : s.y0, out = facing == Facing::kNorth ? 1.0f : -1.0f;
      door.x0 = mixSpan(s.x0, s.x1, a), door.x1 = mixSpan(s.x0, s.x1, b);
      door.y0 = std::min(front, front + 0.02f * out), door.y1 = std::max(front, front + 0.02f * out);
      handle.x0 = door.x1 - 0.08f, handle.x1 = door.x1 - 0.06f;
      handle.y0 = std::min(front, front + 0.05f * out), handle.y1 = std::max(front, front + 0.05f * out);
    } else {
      const float front = facing == Facing::kEast ? s.x1 : s.x0, out = facing == Facing::kEast ? 1.0f : -1.0f;
      door.y0 = mixSpan(s.y0, s.y1, a), door.y1 = mixSpan(s.y0, s.y1, b);
      door.x0 = std::min(front, front + 0.02f * out), door.x1 = std::max(front, front + 0.02f * out);
      handle.y0 = door.y1 - 0.08f, handle.y1 = door.y1 - 0.06f;
      handle.x0 = std::min(front, front + 0.05f * out), handle.x1 = std::max(front, front + 0.05f * out);
    }
    box(door, {i == 1 ? kDamask : kDarkWood, i == 1 ? Vector3f(0.9f, 0.9f, 0.9f) : Vector3f(1.3f, 1.2f, 1.1f)});
    box(handle, {kMarble, {0.5f, 0.5f, 0.5f}});
  }
}

void Furnisher::plant(float x, float y, float z, float size) {
  cylinder({x, y, z}, 0.16f * size, 0.28f * size, {kBrick, {0.95f, 0.8f, 0.7f}});
  cylinder({x, y, z + 0.28f * size}, 0.02f * size, 0.3f * size, {kDarkWood, Vector3f::Ones()});
  for (int i = 0; i < 12; ++i) {
    const float a = random_.uniform(0, 6.283f), r = random_.uniform(0.02f, 0.2f) * size;
    ellipsoid({x + r * std::cos(a), y + r * std::sin(a), z + random_.uniform(0.5f, 1.0f) * size},
              {random_.uniform(0.06f, 0.14f) * size, random_.uniform(0.06f, 0.14f) * size,
               random_.uniform(0.05f, 0.12f) * size},
              {kLeaf, Vector3f::Constant(random_.uniform(0.7f, 1.2f))});
  }
}

void Furnisher::floorLamp(float x, float y) {
  cylinder({x, y, 0}, 0.14f, 0.03f, {kMarble, {0.5f, 0.5f, 0.55f}});
  cylinder({x, y, 0.03f}, 0.015f, 1.35f, {kMarble, {0.6f, 0.55f, 0.4f}});
  cylinder({x, y, 1.38f}, 0.17f, 0.27f, {kStripes, {1.3f, 1.2f, 0.95f}});
}

void Furnisher::clutter(const Span& s, int count) {
  // A grid of places, so that things do not stand in each other.
  const float length = s.x1 - s.x0, width = s.y1 - s.y0;
  const int rows = width > 0.35f ? 2 : 1, columns = (count + rows - 1) / rows;
  for (int i = 0; i < count; ++i) {
    const float x = s.x0 + length * (static_cast<float>(i / rows) + 0.5f) / static_cast<float>(columns);
    const float y = s.y0 + width * (static_cast<float>(i % rows) + 0.5f) / static_cast<float>(rows);
    const float room = 0.42f * std::min(length / static_cast<float>(columns), width / static_cast<float>(rows));
    const float z = s.z1;
    switch (random_.below(5)) {
      case 0:
        cylinder({x, y, z}, std::min(room, 0.045f), 0.1f, {kStripes, colour(0.3f, 1.2f)});
        break;
      case 1:
        ellipsoid({x, y, z + 0.05f}, {std::min(room, 0.07f), std::min(room, 0.07f), 0.05f},
                  {kMarble, colour(0.3f, 1.1f)});
        break;
      case 2: {
        const float yaw = random_.uniform(-40, 40);
        for (int layer = 0; layer < 3; ++layer) {
          const float half = std::min(room * 0.7f, 0.11f - 0.012f * static_cast<float>(layer));
          turnedBox({x, y, z + 0.015f + 0.03f * static_cast<float>(layer)}, {half, 0.72f * half, 0.0145f},
                    yaw + random_.uniform(-12, 12), {kBook, colour(0.1f, 1), true});
        }
        break;
      }
      case 3:
        turnedBox({x, y, z + 0.07f}, {std::min(room * 0.7f, 0.08f), std::min(room * 0.6f, 0.05f), 0.07f},
                  random_.uniform(-45, 45), {kQuilt, colour(0.5f, 1.1f), true});
        break;
      default:
        cylinder({x, y, z}, std::min(room, 0.055f), 0.06f, {kMarble, colour(0.4f, 1.1f)});
        ellipsoid({x, y, z + 0.13f}, {std::min(room, 0.05f), std::min(room, 0.05f), 0.075f},
                  {kFabric, colour(0.3f, 1.2f)});
    }
  }
}

void Furnisher::picture(float x, float y, float z, float width, float height, Facing facing, int texture) {
  const Vector3f half =
      alongX(facing) ? Vector3f(width / 2, 0.015f, height / 2) : Vector3f(0.015f, width / 2, height / 2);
  turnedBox({x, y, z}, half, 0, {texture, Vector3f::Ones(), true});
}

void Furnisher::skirting(const Span& r, float height) {
  constexpr float kDeep = 0.018f;
  const Finish finish{kDarkWood, {1.2f, 1.1f, 1.0f}};
  box({r.x0, r.y0, 0, r.x1, r.y0 + kDeep, height}, finish);
  box({r.x0, r.y1 - kDeep, 0, r.x1, r.y1, height}, finish);
  box({r.x0, r.y0, 0, r.x0 + kDeep, r.y1, height}, finish);
  box({r.x1 - kDeep, r.y0, 0, r.x1, r.y1, height}, finish);
}

}  // namespace comap
