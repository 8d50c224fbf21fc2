// Analytic rooms: exact shapes, textures, lamps, and the routes robots walk through them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "fleet_tools/synth/scene_texture.h"
#include "protocol/types/result.h"

namespace comap {

enum class Shape : uint8_t { kBox, kEllipsoid, kCylinder };

/// A closed solid. World z is up, metres. Local x, y, z are the rows of `R_local_world`; a cylinder stands along its z.
struct Primitive {
  Shape shape = Shape::kBox;
  Eigen::Vector3f centre = Eigen::Vector3f::Zero();
  Eigen::Matrix3f R_local_world = Eigen::Matrix3f::Identity();
  Eigen::Vector3f half = Eigen::Vector3f::Constant(0.5f);  ///< half extents; radii for curved shapes
  int texture = kPlaster;
  Eigen::Vector3f tint = Eigen::Vector3f::Ones();
  bool fit = false;                                 ///< one repetition covers a face, else true to scale
  Eigen::Vector2f shift = Eigen::Vector2f::Zero();  ///< of the texture, in repetitions
};

struct Lamp {
  Eigen::Vector3f position;
  float strength = 1;
};

/// Where a robot's camera passes and looks: world metres, degrees; yaw 0 looks along x and turns to y, pitch up.
/// Yaw does not wrap: 350 to 370 is a turn by 20 degrees.
struct WayPoint {
  double x, y, z, yaw_deg, pitch_deg;
};

/// A closed walk of way points. A robot begins `gaps` times the chain gap (synth_path.h) after way point `anchor`.
struct Route {
  std::vector<WayPoint> loop;
  size_t anchor = 0;
  int gaps = 0;
};

struct Scene {
  std::string name;
  uint64_t seed = 0;  ///< of the textures, by TextureId, that the primitives refer to
  std::vector<Primitive> primitives;
  std::vector<Lamp> lamps;
  std::vector<Route> routes;  ///< by robot: a, b, c, ...
};

struct SceneInfo {
  const char* name;
  const char* description;
};

/// The scenes there are, with one line about each.
std::vector<SceneInfo> knownScenes();

/// kWrongUse, with the known names, if there is no such scene. The seed varies books, pictures, grain.
Result<Scene> makeScene(const std::string& name, uint64_t seed);

/// Distance from `point` to the solid's bounding box in its own axes, 0 inside, metres: never more than to the solid.
float clearance(const Primitive& primitive, const Eigen::Vector3f& point);

}  // namespace comap
