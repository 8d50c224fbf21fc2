#include "fleet_tools/synth/scene_furniture.h"
#include "fleet_tools/synth/scene_rooms.h"

namespace comap {

void furnishCorridor(Scene& scene, uint64_t seed) {
  constexpr float kLength = 14, kWidth = 2.0f, kHeight = 2.5f;
  Furnisher f(scene, mixBits(seed, 1));
  f.box({-0.2f, -0.2f, -0.2f, kLength + 0.2f, kWidth + 0.2f, 0}, {kPaint, {0.72f, 0.74f, 0.78f}});
  f.box({-0.2f, -0.2f, kHeight, kLength + 0.2f, kWidth + 0.2f, kHeight + 0.2f}, {kPaint, {1.12f, 1.12f, 1.12f}});
  f.box({-0.2f, -0.2f, 0, kLength + 0.2f, 0, kHeight}, {kPaint, {1.05f, 1.03f, 0.96f}});
  f.box({-0.2f, kWidth, 0, kLength + 0.2f, kWidth + 0.2f, kHeight}, {kPaint, {1.05f, 1.03f, 0.96f}});
  f.box({-0.2f, 0, 0, 0, kWidth, kHeight}, {kPaint, {0.9f, 1.0f, 0.95f}});
  f.box({kLength, 0, 0, kLength + 0.2f, kWidth, kHeight}, {kPaint, {0.9f, 0.95f, 1.05f}});
  f.skirting({0, 0, 0, kLength, kWidth, 0}, 0.1f);
  // Doors alternate; each has a frame, a handle and a sign.
  for (int i = 0; i < 5; ++i) {
    const float x = 1.3f + 2.6f * static_cast<float>(i);
    const bool south = i % 2 == 0;
    const float y0 = south ? 0.0f : kWidth - 0.05f, y1 = south ? 0.05f : kWidth;
    const float front = south ? 0.05f : kWidth - 0.05f, out = south ? 0.012f : -0.012f;
    f.box({x - 0.52f, y0, 0, x + 0.52f, y1, 2.12f}, {kPaint, {0.7f, 0.72f, 0.75f}});
    f.box({x - 0.45f, std::min(front, front + out), 0.01f, x + 0.45f, std::max(front, front + out), 2.05f},
          {kPaint, {0.75f, 0.55f, 0.4f}});
    f.ellipsoid({x + 0.36f, front + 4 * out, 1.02f}, {0.06f, 0.025f, 0.02f}, {kMarble, {0.7f, 0.7f, 0.72f}});
    f.picture(x + 0.72f, south ? 0.01f : kWidth - 0.01f, 1.55f, 0.2f, 0.12f, south ? Facing::kNorth : Facing::kSouth,
              kFirstPicture + i);
  }
  f.picture(3.4f, kWidth - 0.015f, 1.5f, 0.5f, 0.65f, Facing::kSouth, kFirstPicture + 6);
  f.picture(8.6f, 0.015f, 1.5f, 0.7f, 0.5f, Facing::kNorth, kFirstPicture + 7);
  f.box({5.6f, kWidth - 0.1f, 0.15f, 6.7f, kWidth - 0.02f, 0.75f}, {kStripes, {1.2f, 1.2f, 1.2f}});
  f.cylinder({10.4f, 0.12f, 0.9f}, 0.08f, 0.45f, {kPaint, {1.0f, 0.15f, 0.12f}});
  f.plant(kLength - 0.3f, 0.3f, 0, 0.9f);
  f.plant(0.3f, kWidth - 0.3f, 0, 0.8f);
  for (int i = 0; i < 4; ++i) scene.lamps.push_back({{1.75f + 3.5f * static_cast<float>(i), 1.0f, 2.4f}, 0.6f});

  std::vector<WayPoint> round;
  const double height = 1.33;
  // Along the middle, glancing at one wall and the other, and back.
  for (int i = 0; i <= 16; ++i) {
    round.push_back({1.6 + 0.66 * i, 0.9, height + 0.02 * (i % 3), i % 4 < 2 ? 24.0 : -24.0, -9});
  }
  round.push_back({12.6, 0.98, height, 40, -9});
  round.push_back({12.65, 1.06, height, 90, -9});
  round.push_back({12.6, 1.1, height, 140, -9});
  for (int i = 16; i >= 0; --i) {
    round.push_back({1.6 + 0.66 * i, 1.1, height + 0.02 * (i % 3), 180 + (i % 4 < 2 ? 24.0 : -24.0), -9});
  }
  round.push_back({1.2, 1.02, height, 220, -9});
  round.push_back({1.15, 0.96, height, 270, -9});
  round.push_back({1.2, 0.9, height, 320, -9});
  for (const int gaps : {-1, 0, -2, 1}) scene.routes.push_back({round, 8, gaps});
}

}  // namespace comap
