#include <cmath>
#include <numbers>

#include "fleet_tools/synth/scene_furniture.h"
#include "fleet_tools/synth/scene_rooms.h"

namespace comap {
namespace {

// Nothing but painted walls, a door and a skirting board.
void buildRoom(Scene& scene, uint64_t seed, float x, float length, float width, float door) {
  Furnisher f(scene, seed, {x, 0, 0});
  constexpr float kHeight = 2.5f;
  const Finish white = {kPaint, {1.05f, 1.03f, 0.96f}};
  f.box({-0.2f, -0.2f, -0.2f, length + 0.2f, width + 0.2f, 0}, {kPaint, {0.72f, 0.74f, 0.78f}});
  f.box({-0.2f, -0.2f, kHeight, length + 0.2f, width + 0.2f, kHeight + 0.2f}, {kPaint, {1.12f, 1.12f, 1.12f}});
  f.box({-0.2f, -0.2f, 0, length + 0.2f, 0, kHeight}, white);
  f.box({-0.2f, width, 0, length + 0.2f, width + 0.2f, kHeight}, white);
  f.box({-0.2f, 0, 0, 0, width, kHeight}, white);
  f.box({length, 0, 0, length + 0.2f, width, kHeight}, white);
  f.skirting({0, 0, 0, length, width, 0}, 0.1f);
  f.box({door - 0.5f, 0, 0, door + 0.5f, 0.05f, 2.1f}, {kPaint, {0.7f, 0.72f, 0.75f}});
  f.box({door - 0.43f, 0.05f, 0.01f, door + 0.43f, 0.062f, 2.03f}, {kPaint, {0.75f, 0.55f, 0.4f}});
  scene.lamps.push_back({{x + length / 2, width / 2, 2.4f}, 1.0f});
}

// Around the middle, turned to the walls.
std::vector<WayPoint> roundOf(double x, double length, double width) {
  constexpr int kSteps = 16;
  std::vector<WayPoint> round;
  for (int i = 0; i < kSteps; ++i) {
    const double angle = 2 * std::numbers::pi * i / kSteps;
    round.push_back({x + length / 2 + 0.9 * std::cos(angle), width / 2 + 0.7 * std::sin(angle), 1.3 + 0.02 * (i % 3),
                     360.0 * i / kSteps, -8});
  }
  return round;
}

}  // namespace

void furnishBlank(Scene& scene, uint64_t seed) {
  constexpr float kApart = 10;
  buildRoom(scene, mixBits(seed, 1), 0, 4.4f, 3.6f, 1.2f);
  buildRoom(scene, mixBits(seed, 2), kApart, 5.2f, 3.2f, 3.4f);
  const auto round = roundOf(0, 4.4, 3.6), other = roundOf(kApart, 5.2, 3.2);
  scene.routes = {{round, 0, 0}, {other, 0, 0}, {round, 0, 1}, {other, 0, 1}};
}

}  // namespace comap
