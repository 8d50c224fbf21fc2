#include "fleet_tools/synth/scene_furniture.h"
#include "fleet_tools/synth/scene_rooms.h"

namespace comap {
namespace {

using Eigen::Vector3f;

// Room 1 is [0, 4.6] x [0, 4.2], room 2 [4.72, 9.3] x [0, 4.2], the doorway y 1.55 to 2.65.
constexpr float kHeight = 2.6f, kDepth = 4.2f, kWall0 = 4.6f, kWall1 = 4.72f, kEast = 9.3f;
constexpr float kDoor0 = 1.55f, kDoor1 = 2.65f, kDoorTop = 2.1f;

void buildShell(Furnisher& f) {
  f.box({-0.2f, -0.2f, -0.2f, kWall1, kDepth + 0.2f, 0}, {kPlanks});
  f.box({kWall1, -0.2f, -0.2f, kEast + 0.2f, kDepth + 0.2f, 0}, {kChecker});
  f.box({-0.2f, -0.2f, kHeight, kEast + 0.2f, kDepth + 0.2f, kHeight + 0.2f}, {kPlaster, {1.05f, 1.05f, 1.02f}});
  // Room 1: brick in the south, damask in the north, flowers in the west.
  f.box({-0.2f, -0.2f, 0, kWall0, 0, kHeight}, {kBrick});
  f.box({-0.2f, kDepth, 0, kWall0, kDepth + 0.2f, kHeight}, {kDamask});
  f.box({-0.2f, 0, 0, 0, kDepth, kHeight}, {kStripes});
  // Room 2: other colours of the same trades.
  f.box({kWall0, -0.2f, 0, kEast + 0.2f, 0, kHeight}, {kStripes, {0.85f, 1.0f, 1.15f}});
  f.box({kWall0, kDepth, 0, kEast + 0.2f, kDepth + 0.2f, kHeight}, {kPlaster, {0.95f, 0.8f, 0.62f}});
  f.box({kEast, 0, 0, kEast + 0.2f, kDepth, kHeight}, {kDamask, {0.7f, 0.95f, 0.9f}});
  // The wall between, with its doorway and a frame around it.
  f.box({kWall0, 0, 0, kWall1, kDoor0, kHeight}, {kPlaster, {0.75f, 0.9f, 0.8f}});
  f.box({kWall0, kDoor1, 0, kWall1, kDepth, kHeight}, {kPlaster, {0.75f, 0.9f, 0.8f}});
  f.box({kWall0, kDoor0, kDoorTop, kWall1, kDoor1, kHeight}, {kPlaster, {0.75f, 0.9f, 0.8f}});
  const Finish frame{kWood, {1.1f, 1.0f, 0.9f}};
  f.box({kWall0 - 0.015f, kDoor0 - 0.07f, 0, kWall1 + 0.015f, kDoor0 + 0.012f, kDoorTop}, frame);
  f.box({kWall0 - 0.015f, kDoor1 - 0.012f, 0, kWall1 + 0.015f, kDoor1 + 0.07f, kDoorTop}, frame);
  f.box({kWall0 - 0.015f, kDoor0 - 0.07f, kDoorTop - 0.012f, kWall1 + 0.015f, kDoor1 + 0.07f, kDoorTop + 0.07f}, frame);
  for (const auto& [x0, x1] : {std::pair{0.0f, kWall0}, std::pair{kWall1, kEast}}) {
    const Finish skirting{kDarkWood, {1.2f, 1.1f, 1.0f}};
    f.box({x0, 0, 0, x1, 0.018f, 0.09f}, skirting);
    f.box({x0, kDepth - 0.018f, 0, x1, kDepth, 0.09f}, skirting);
    const float inner = x0 == 0 ? kWall0 - 0.014f : kWall1;
    f.box({inner, 0.018f, 0, inner + 0.014f, kDoor0 - 0.07f, 0.09f}, skirting);
    f.box({inner, kDoor1 + 0.07f, 0, inner + 0.014f, kDepth - 0.018f, 0.09f}, skirting);
  }
}

void furnishLivingRoom(Furnisher& f) {
  f.box({1.2f, 1.55f, 0, 3.2f, 2.95f, 0.012f}, {kRug, Vector3f::Ones(), true});
  f.sofa({1.1f, 3.3f, 0, 3.1f, 4.15f, 0.85f}, Facing::kSouth, {0.35f, 0.5f, 0.75f});
  f.picture(2.1f, 4.185f, 1.6f, 1.1f, 0.7f, Facing::kSouth, kFirstPicture);
  f.picture(3.35f, 4.185f, 1.7f, 0.5f, 0.6f, Facing::kSouth, kFirstPicture + 1);
  f.picture(0.65f, 4.185f, 1.55f, 0.45f, 0.6f, Facing::kSouth, kFirstPicture + 2);
  f.floorLamp(3.75f, 3.75f);

  f.table({1.75f, 2.3f, 0.012f, 2.65f, 2.85f, 0.42f}, {kDarkWood}, 0.05f);
  f.clutter({1.8f, 2.35f, 0, 2.6f, 2.8f, 0.42f}, 6);

  f.bookshelf({0.35f, 0.02f, 0, 1.75f, 0.32f, 2.05f}, Facing::kNorth, 6);
  f.table({2.1f, 0.05f, 0, 3.5f, 0.68f, 0.74f}, {kWood}, 0.05f);
  f.box({2.45f, 0.2f, 0.78f, 3.05f, 0.23f, 1.14f}, {kDarkWood, {0.4f, 0.4f, 0.4f}});
  f.box({2.46f, 0.23f, 0.79f, 3.04f, 0.235f, 1.13f}, {kScreen, Vector3f::Ones(), true});
  f.cylinder({2.75f, 0.2f, 0.74f}, 0.1f, 0.04f, {kMarble, {0.4f, 0.4f, 0.4f}});
  f.clutter({2.15f, 0.35f, 0, 3.45f, 0.62f, 0.74f}, 6);
  f.chair(2.8f, 0.95f, -80, {kFabric, {0.8f, 0.35f, 0.3f}});
  f.picture(2.35f, 0.015f, 1.75f, 0.5f, 0.5f, Facing::kNorth, kFirstPicture + 3);
  f.picture(3.15f, 0.015f, 1.65f, 0.7f, 0.5f, Facing::kNorth, kFirstPicture + 4);

  f.box({-0.005f, 1.0f, 0.95f, 0.012f, 2.4f, 2.1f}, {kWindowView, Vector3f::Ones(), true});
  f.box({0, 0.9f, 0.9f, 0.16f, 2.5f, 0.95f}, {kMarble});
  f.plant(0.09f, 1.2f, 0.95f, 0.45f);
  f.plant(0.09f, 2.15f, 0.95f, 0.4f);
  f.box({0.02f, 1.05f, 0.12f, 0.1f, 2.35f, 0.75f}, {kStripes, {1.2f, 1.2f, 1.2f}});
  f.bookshelf({0.02f, 2.75f, 0, 0.32f, 3.85f, 1.5f}, Facing::kEast, 4);
  f.plant(0.18f, 3.3f, 1.5f, 0.55f);

  f.box({4.2f, 0.15f, 0, 4.58f, 1.3f, 0.85f}, {kDarkWood, {1.3f, 1.1f, 0.9f}});
  for (int i = 0; i < 3; ++i) {
    const float y = 0.2f + 0.37f * static_cast<float>(i);
    f.box({4.185f, y, 0.1f, 4.2f, y + 0.33f, 0.78f}, {kWood, {0.9f, 0.7f, 0.55f}});
    f.ellipsoid({4.18f, y + 0.28f, 0.5f}, {0.02f, 0.02f, 0.02f}, {kMarble});
  }
  f.clutter({4.22f, 0.2f, 0, 4.56f, 1.25f, 0.85f}, 2);
  f.plant(4.38f, 0.75f, 0.85f, 0.5f);
  f.picture(4.585f, 0.75f, 1.75f, 0.8f, 0.6f, Facing::kWest, kFirstPicture + 5);
  f.picture(4.585f, 3.2f, 1.6f, 0.7f, 0.9f, Facing::kWest, kFirstPicture + 6);
  f.box({4.36f, 2.9f, 0.95f, 4.6f, 3.9f, 0.98f}, {kWood});
  f.clutter({4.38f, 2.95f, 0, 4.58f, 3.85f, 0.98f}, 1);
  f.plant(4.25f, 3.8f, 0, 0.8f);
}

void furnishBedroom(Furnisher& f) {
  f.box({5.6f, 1.2f, 0, 7.4f, 2.2f, 0.012f}, {kRug, {0.75f, 1.05f, 1.2f}, true});
  f.bed({6.1f, 2.55f, 0, 7.6f, 4.12f, 0.5f});
  f.table({5.6f, 3.7f, 0, 6.0f, 4.15f, 0.52f}, {kWood}, 0.04f);
  f.cylinder({5.8f, 3.95f, 0.52f}, 0.05f, 0.2f, {kMarble, {0.8f, 0.6f, 0.4f}});
  f.cylinder({5.8f, 3.95f, 0.72f}, 0.13f, 0.2f, {kStripes, {1.3f, 1.2f, 0.9f}});
  f.picture(6.85f, 4.185f, 1.75f, 1.3f, 0.8f, Facing::kSouth, kFirstPicture + 7);
  f.picture(5.4f, 4.185f, 1.6f, 0.6f, 0.8f, Facing::kSouth, kFirstPicture + 8);
  f.picture(8.2f, 4.185f, 1.6f, 0.6f, 0.6f, Facing::kSouth, kFirstPicture + 9);

  f.wardrobe({8.65f, 2.3f, 0, 9.28f, 4.1f, 2.1f}, Facing::kWest);
  f.box({8.8f, 2.5f, 2.1f, 9.2f, 3.0f, 2.35f}, {kQuilt, {0.9f, 0.8f, 0.7f}, true});
  f.box({8.75f, 3.3f, 2.1f, 9.2f, 3.9f, 2.3f}, {kStripes, {0.7f, 0.6f, 0.9f}});
  f.box({kEast - 0.012f, 0.7f, 0.95f, kEast + 0.005f, 1.9f, 2.1f}, {kWindowView, {1.1f, 0.95f, 0.85f}, true});
  f.box({9.14f, 0.6f, 0.9f, kEast, 2.0f, 0.95f}, {kMarble});
  f.plant(9.2f, 0.85f, 0.95f, 0.4f);

  f.table({7.2f, 0.1f, 0, 8.7f, 0.8f, 0.75f}, {kWood, {0.9f, 0.75f, 0.65f}}, 0.06f);
  f.clutter({7.25f, 0.15f, 0, 8.65f, 0.75f, 0.75f}, 10);
  f.chair(7.6f, 0.98f, -95, {kQuilt, {0.9f, 0.9f, 0.7f}});
  f.chair(8.35f, 1.0f, -70, {kQuilt, {0.7f, 0.9f, 0.9f}});
  f.picture(7.95f, 0.015f, 1.6f, 0.9f, 0.6f, Facing::kNorth, kFirstPicture + 10);
  f.picture(7.1f, 0.015f, 1.7f, 0.45f, 0.6f, Facing::kNorth, kFirstPicture + 11);
  f.bookshelf({5.1f, 0.02f, 0, 6.5f, 0.32f, 2.0f}, Facing::kNorth, 6);
  f.picture(kWall1 + 0.015f, 0.8f, 1.55f, 0.6f, 0.8f, Facing::kEast, kFirstPicture + 2);
  f.picture(kWall1 + 0.015f, 3.35f, 1.6f, 0.9f, 0.6f, Facing::kEast, kFirstPicture + 4);
  f.plant(5.05f, 3.75f, 0, 1.0f);
}

}  // namespace

void furnishFlat(Scene& scene, uint64_t seed) {
  Furnisher f(scene, mixBits(seed, 1));
  buildShell(f);
  furnishLivingRoom(f);
  furnishBedroom(f);
  scene.lamps = {
      {{2.3f, 2.1f, 2.45f}, 1.0f}, {{7.0f, 2.0f, 2.45f}, 1.0f}, {{0.4f, 1.7f, 1.6f}, 0.5f}, {{8.8f, 1.3f, 1.6f}, 0.5f}};
  // One round through both rooms and back; the robots follow each other on it, so that each ends where the next began.
  const std::vector<WayPoint> round = {
      {2.60, 1.60, 1.32, -28, -12}, {3.20, 1.80, 1.34, -22, -10}, {3.80, 1.98, 1.33, 2, -8},
      {4.40, 2.08, 1.31, 14, -8},   {5.00, 2.10, 1.32, 8, -9},    {5.60, 2.04, 1.35, -6, -10},
      {6.20, 1.92, 1.36, -22, -12}, {6.80, 1.82, 1.34, -34, -12}, {7.40, 1.80, 1.32, -18, -11},
      {7.90, 1.84, 1.33, 14, -8},   {8.20, 1.96, 1.35, 56, -8},   {8.15, 2.14, 1.36, 100, -10},
      {7.85, 2.24, 1.34, 132, -13}, {7.40, 2.22, 1.33, 140, -14}, {6.80, 2.16, 1.33, 142, -13},
      {6.20, 2.12, 1.35, 160, -10}, {5.60, 2.12, 1.36, 186, -9},  {5.00, 2.12, 1.34, 190, -9},
      {4.40, 2.14, 1.33, 178, -10}, {3.80, 2.22, 1.34, 160, -12}, {3.20, 2.36, 1.36, 148, -12},
      {2.60, 2.50, 1.35, 152, -12}, {2.00, 2.54, 1.33, 170, -11}, {1.40, 2.46, 1.32, 196, -10},
      {1.02, 2.22, 1.34, 226, -9},  {0.98, 1.88, 1.35, 258, -11}, {1.25, 1.62, 1.34, 288, -12},
      {1.62, 1.52, 1.33, 306, -13}, {2.08, 1.52, 1.32, 322, -13}};
  for (const int gaps : {-1, 0, -2, 1}) scene.routes.push_back({round, 4, gaps});
}

}  // namespace comap
