// Light that does not depend on where one looks from, computed once per scene.
#pragma once

#include <vector>

#include "fleet_tools/synth/scene.h"
#include "fleet_tools/synth/scene_surface.h"

namespace comap {

/// Brightness of every surface from the lamps (with soft shadows) and from the room itself (darker in corners), on a
/// grid of about 8 cm per face.
class LightMap {
 public:
  LightMap(const Scene& scene, int threads);

  /// Factor on the surface's colour, about 0.25 to 1.2.
  float at(int primitive, const SurfaceSpot& spot) const;

 private:
  struct Grid {
    int columns = 0, rows = 0;
    bool wraps = false;  ///< around a curved side
    size_t first = 0;
  };
  std::vector<size_t> first_grid_;  ///< by primitive
  std::vector<Grid> grids_;         ///< by primitive and face
  std::vector<float> values_;
};

}  // namespace comap
