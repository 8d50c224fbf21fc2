#include <algorithm>

#include "fleet_tools/synth/scene_furniture.h"
#include "fleet_tools/synth/scene_rooms.h"

namespace comap {
namespace {

constexpr float kPitch = 2.4f, kWidth = 2.0f, kHeight = 2.5f;
constexpr int kDoors = 7;
constexpr float kLength = kPitch * kDoors;

// All doors are alike and stand at even distances on both sides; only their numbers differ, and what is on the walls.
void hangDoor(Furnisher& f, float x, bool south, int number) {
  const float wall = south ? 0 : kWidth, into = south ? 1.0f : -1.0f;
  const auto slab = [&](float x0, float x1, float z0, float z1, float from, float to, const Finish& finish) {
    const float y0 = wall + into * from, y1 = wall + into * to;
    f.box({x0, std::min(y0, y1), z0, x1, std::max(y0, y1), z1}, finish);
  };
  slab(x - 0.52f, x + 0.52f, 0, 2.12f, 0, 0.05f, {kPaint, {0.7f, 0.72f, 0.75f}});
  slab(x - 0.45f, x + 0.45f, 0.01f, 2.05f, 0.05f, 0.062f, {kWood});
  f.ellipsoid({x + 0.36f, wall + into * 0.1f, 1.02f}, {0.06f, 0.025f, 0.02f}, {kMarble, {0.7f, 0.7f, 0.72f}});
  f.picture(x + 0.7f, wall + into * 0.012f, 1.5f, 0.16f, 0.16f, south ? Facing::kNorth : Facing::kSouth,
            kFirstPicture + number % kPictures);
}

void furnishFloor(Scene& scene, uint64_t seed, float y, int first_number) {
  Furnisher f(scene, seed, {0, y, 0});
  f.box({-0.2f, -0.2f, -0.2f, kLength + 0.2f, kWidth + 0.2f, 0}, {kChecker, {0.8f, 0.8f, 0.82f}});
  f.box({-0.2f, -0.2f, kHeight, kLength + 0.2f, kWidth + 0.2f, kHeight + 0.2f}, {kPaint, {1.12f, 1.12f, 1.12f}});
  // No two walls are plastered alike.
  const auto wall = [&](const Span& span) {
    f.box(span, {kPlaster}).shift = {f.random().uniform(0, 1), f.random().uniform(0, 1)};
  };
  wall({-0.2f, -0.2f, 0, kLength + 0.2f, 0, kHeight});
  wall({-0.2f, kWidth, 0, kLength + 0.2f, kWidth + 0.2f, kHeight});
  wall({-0.2f, 0, 0, 0, kWidth, kHeight});
  wall({kLength, 0, 0, kLength + 0.2f, kWidth, kHeight});
  f.skirting({0, 0, 0, kLength, kWidth, 0}, 0.1f);
  for (int i = 0; i < kDoors; ++i) {
    const float x = kPitch * (static_cast<float>(i) + 0.5f);
    hangDoor(f, x, true, first_number + 2 * i);
    hangDoor(f, x, false, first_number + 2 * i + 1);
    scene.lamps.push_back({{x, y + 1, 2.4f}, 0.5f});
  }
}

// To and fro along the middle, glancing at one wall and the other.
std::vector<WayPoint> roundOf(double y) {
  constexpr int kSteps = 20;
  constexpr double kStart = 1.6, kStep = 0.66, kEye = 1.33;
  std::vector<WayPoint> round;
  for (int i = 0; i <= kSteps; ++i)
    round.push_back({kStart + kStep * i, y + 0.9, kEye + 0.02 * (i % 3), i % 4 < 2 ? 38.0 : -38.0, -9});
  const double end = kStart + kStep * kSteps;
  round.push_back({end + 0.4, y + 0.98, kEye, 40, -9});
  round.push_back({end + 0.45, y + 1.06, kEye, 90, -9});
  round.push_back({end + 0.4, y + 1.1, kEye, 140, -9});
  for (int i = kSteps; i >= 0; --i)
    round.push_back({kStart + kStep * i, y + 1.1, kEye + 0.02 * (i % 3), 180 + (i % 4 < 2 ? 38.0 : -38.0), -9});
  round.push_back({kStart - 0.4, y + 1.02, kEye, 220, -9});
  round.push_back({kStart - 0.45, y + 0.96, kEye, 270, -9});
  round.push_back({kStart - 0.4, y + 0.9, kEye, 320, -9});
  return round;
}

}  // namespace

void furnishDoors(Scene& scene, uint64_t seed) {
  constexpr float kApart = 4;
  furnishFloor(scene, mixBits(seed, 1), 0, 0);
  furnishFloor(scene, mixBits(seed, 2), kApart, 5);
  // b begins a door and a half further on than a does, on the other floor.
  scene.routes = {{roundOf(0), 3, 0}, {roundOf(kApart), 8, 0}, {roundOf(0), 3, 1}, {roundOf(kApart), 8, 1}};
}

}  // namespace comap
