#include "fleet_tools/synth/scene_furniture.h"
#include "fleet_tools/synth/scene_rooms.h"

namespace comap {
namespace {

// Everything a hotel would buy twice is the same in both rooms; what guests bring (books, pictures, things on tables,
// where the chair was left) is not.
void furnishRoom(Scene& scene, uint64_t shared_seed, uint64_t own_seed, float x, int picture) {
  const Eigen::Vector3f origin(x, 0, 0);
  Furnisher same(scene, shared_seed, origin), own(scene, own_seed, origin);
  constexpr float kEdge = 4.2f, kHeight = 2.6f;
  same.box({-0.15f, -0.15f, -0.2f, kEdge + 0.15f, kEdge + 0.15f, 0}, {kPlanks});
  same.box({-0.15f, -0.15f, kHeight, kEdge + 0.15f, kEdge + 0.15f, kHeight + 0.2f}, {kPlaster});
  same.box({-0.15f, -0.15f, 0, kEdge + 0.15f, 0, kHeight}, {kDamask});
  same.box({-0.15f, kEdge, 0, kEdge + 0.15f, kEdge + 0.15f, kHeight}, {kStripes});
  same.box({-0.15f, 0, 0, 0, kEdge, kHeight}, {kPlaster, {0.9f, 0.85f, 0.7f}});
  same.box({kEdge, 0, 0, kEdge + 0.15f, kEdge, kHeight}, {kBrick});
  same.skirting({0, 0, 0, kEdge, kEdge, 0}, 0.09f);
  same.box({1.2f, 1.3f, 0, 3.0f, 2.7f, 0.012f}, {kRug, Eigen::Vector3f::Ones(), true});
  same.sofa({1.1f, 3.35f, 0, 3.0f, 4.15f, 0.85f}, Facing::kSouth, {0.6f, 0.35f, 0.35f});
  same.table({2.3f, 0.05f, 0, 3.7f, 0.7f, 0.74f}, {kWood}, 0.05f);
  same.wardrobe({0.02f, 2.5f, 0, 0.6f, 3.9f, 2.1f}, Facing::kEast);
  same.floorLamp(3.7f, 3.75f);
  same.box({kEdge - 0.012f, 1.2f, 0.95f, kEdge + 0.005f, 2.6f, 2.1f}, {kWindowView, Eigen::Vector3f::Ones(), true});
  same.box({kEdge - 0.16f, 1.1f, 0.9f, kEdge, 2.7f, 0.95f}, {kMarble});

  own.bookshelf({0.4f, 0.02f, 0, 1.8f, 0.32f, 2.0f}, Facing::kNorth, 6);
  own.clutter({2.35f, 0.1f, 0, 3.65f, 0.65f, 0.74f}, 8);
  own.chair(2.85f + own.random().uniform(-0.2f, 0.2f), 0.98f, own.random().uniform(-120, -60),
            {kFabric, {0.4f, 0.6f, 0.4f}});
  own.plant(kEdge - 0.09f, own.random().uniform(1.4f, 2.4f), 0.95f, 0.42f);
  own.picture(1.4f, kEdge - 0.015f, 1.6f, 0.8f, 0.6f, Facing::kSouth, kFirstPicture + picture);
  own.picture(2.6f, kEdge - 0.015f, 1.65f, 0.6f, 0.7f, Facing::kSouth, kFirstPicture + picture + 1);
  own.picture(3.0f, 0.015f, 1.65f, 0.9f, 0.6f, Facing::kNorth, kFirstPicture + picture + 2);
  own.picture(0.015f, 1.5f, 1.55f, 0.8f, 0.6f, Facing::kEast, kFirstPicture + picture + 3);
  scene.lamps.push_back({{x + 2.1f, 2.0f, 2.45f}, 1.0f});
  scene.lamps.push_back({{x + 3.8f, 1.9f, 1.7f}, 0.5f});
}

std::vector<WayPoint> roundOf(double x) {
  std::vector<WayPoint> round = {{1.2, 1.3, 1.32, -50, -12},  {1.7, 1.25, 1.33, -40, -12}, {2.2, 1.3, 1.34, -25, -12},
                                 {2.7, 1.4, 1.33, 0, -10},    {3.1, 1.65, 1.32, 30, -9},   {3.25, 2.05, 1.34, 65, -10},
                                 {3.05, 2.45, 1.35, 95, -12}, {2.6, 2.65, 1.34, 115, -13}, {2.1, 2.7, 1.33, 130, -13},
                                 {1.6, 2.6, 1.33, 160, -10},  {1.2, 2.35, 1.34, 195, -9},  {1.0, 1.95, 1.34, 235, -10},
                                 {1.0, 1.6, 1.33, 275, -12}};
  for (auto& point : round) point.x += x;
  return round;
}

// Turns what the scene holds from these on into its mirror image in the plane x = `plane`. Solids are symmetric, so
// only where they are and how they are turned changes; what is printed on them is not mirrored, as in a house.
void mirror(Scene& scene, size_t first_primitive, size_t first_lamp, float plane) {
  const Eigen::DiagonalMatrix<float, 3> flip(-1, 1, 1);
  for (size_t i = first_primitive; i < scene.primitives.size(); ++i) {
    Primitive& primitive = scene.primitives[i];
    primitive.centre.x() = 2 * plane - primitive.centre.x();
    primitive.R_local_world = flip * primitive.R_local_world * flip;
  }
  for (size_t i = first_lamp; i < scene.lamps.size(); ++i)
    scene.lamps[i].position.x() = 2 * plane - scene.lamps[i].position.x();
}

std::vector<WayPoint> mirrored(std::vector<WayPoint> round, double plane) {
  for (WayPoint& point : round) {
    point.x = 2 * plane - point.x;
    point.yaw_deg = 180 - point.yaw_deg;
  }
  return round;
}

}  // namespace

void furnishTwins(Scene& scene, uint64_t seed) {
  constexpr float kApart = 8;
  furnishRoom(scene, mixBits(seed, 1), mixBits(seed, 2), 0, 0);
  furnishRoom(scene, mixBits(seed, 1), mixBits(seed, 3), kApart, 4);
  scene.routes = {{roundOf(0), 0, 0}, {roundOf(kApart), 0, 0}, {roundOf(0), 0, 1}, {roundOf(kApart), 0, 1}};
}

void furnishMirror(Scene& scene, uint64_t seed) {
  constexpr float kPlane = 6;
  furnishRoom(scene, mixBits(seed, 1), mixBits(seed, 2), 0, 0);
  const size_t first_primitive = scene.primitives.size(), first_lamp = scene.lamps.size();
  furnishRoom(scene, mixBits(seed, 1), mixBits(seed, 2), 0, 0);
  mirror(scene, first_primitive, first_lamp, kPlane);
  const auto round = roundOf(0), other = mirrored(roundOf(0), kPlane);
  scene.routes = {{round, 0, 0}, {other, 0, 0}, {round, 0, 1}, {other, 0, 1}};
}

}  // namespace comap
