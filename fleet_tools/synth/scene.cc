#include "fleet_tools/synth/scene.h"

#include <algorithm>

#include "fleet_tools/synth/scene_rooms.h"

namespace comap {

std::vector<SceneInfo> knownScenes() {
  return {{"flat", "a furnished two-room flat; the robots start in different rooms and meet at the doorway"},
          {"twins", "two rooms furnished alike and apart from each other: a and c in one, b and d in the other"},
          {"mirror", "a room and its mirror image: a and c in one, b and d in the other"},
          {"doors", "two corridors with doors all alike: a and c in one, b and d in the other"},
          {"blank", "two bare rooms of different size, painted white: a and c in one, b and d in the other"},
          {"corridor", "a long painted corridor, poor in texture and shape"}};
}

Result<Scene> makeScene(const std::string& name, uint64_t seed) {
  Scene scene;
  scene.name = name;
  scene.seed = seed;
  if (name == "flat") {
    furnishFlat(scene, seed);
  } else if (name == "twins") {
    furnishTwins(scene, seed);
  } else if (name == "mirror") {
    furnishMirror(scene, seed);
  } else if (name == "doors") {
    furnishDoors(scene, seed);
  } else if (name == "blank") {
    furnishBlank(scene, seed);
  } else if (name == "corridor") {
    furnishCorridor(scene, seed);
  } else {
    std::string known;
    for (const auto& info : knownScenes()) known += (known.empty() ? "" : ", ") + std::string(info.name);
    return Error{ErrorCode::kWrongUse, "scene '" + name + "' is unknown, known are: " + known};
  }
  return scene;
}

float clearance(const Primitive& primitive, const Eigen::Vector3f& point) {
  const Eigen::Vector3f local = primitive.R_local_world * (point - primitive.centre);
  return (local.cwiseAbs() - primitive.half).cwiseMax(0).norm();
}

}  // namespace comap
