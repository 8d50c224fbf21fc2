// Pieces scenes are furnished with.
#pragma once

#include "fleet_tools/synth/scene.h"
#include "fleet_tools/synth/synth_random.h"

namespace comap {

/// A texture with its colour.
struct Finish {
  int texture = kPlaster;
  Eigen::Vector3f tint = Eigen::Vector3f::Ones();
  bool fit = false;
};

/// A box on the ground plan, from the lower to the upper corner, metres.
struct Span {
  float x0, y0, z0, x1, y1, z1;
};

/// Which way a piece of furniture faces: its front looks towards this world direction.
enum class Facing { kEast, kNorth, kWest, kSouth };

/// Adds solids to a scene. All coordinates are relative to `origin`, so that a room can be built twice.
class Furnisher {
 public:
  Furnisher(Scene& scene, uint64_t seed, Eigen::Vector3f origin = Eigen::Vector3f::Zero())
      : scene_(scene), random_(seed), origin_(origin) {}

  Primitive& box(const Span& span, const Finish& finish);
  Primitive& turnedBox(const Eigen::Vector3f& centre, const Eigen::Vector3f& half, float yaw_deg, const Finish& finish);
  Primitive& ellipsoid(const Eigen::Vector3f& centre, const Eigen::Vector3f& radii, const Finish& finish);
  Primitive& cylinder(const Eigen::Vector3f& base, float radius, float height, const Finish& finish);

  /// Boards and back with rows of books and a few ornaments between them; the open side faces `facing`.
  void bookshelf(const Span& span, Facing facing, int rows);
  void table(const Span& span, const Finish& top, float leg_m);
  void chair(float x, float y, float yaw_deg, const Finish& finish);
  void sofa(const Span& span, Facing facing, const Eigen::Vector3f& colour);
  void bed(const Span& span);
  void wardrobe(const Span& span, Facing facing);
  void plant(float x, float y, float z, float size);
  void floorLamp(float x, float y);
  /// Books, bowls, cups and boxes standing on the top of `span`.
  void clutter(const Span& span, int count);
  /// Hangs flat on a wall: centre, size along the wall and up; `facing` is where one stands to see it.
  void picture(float x, float y, float z, float width, float height, Facing facing, int texture);
  void skirting(const Span& room, float height);

  RandomStream& random() { return random_; }
  Eigen::Vector3f colour(float low, float high);

 private:
  Scene& scene_;
  RandomStream random_;
  Eigen::Vector3f origin_;
};

}  // namespace comap
