// The scenes by name; each fills primitives, lamps and routes.
#pragma once

#include "fleet_tools/synth/scene.h"

namespace comap {

void furnishFlat(Scene& scene, uint64_t seed);
void furnishTwins(Scene& scene, uint64_t seed);
void furnishMirror(Scene& scene, uint64_t seed);
void furnishCorridor(Scene& scene, uint64_t seed);
void furnishDoors(Scene& scene, uint64_t seed);
void furnishBlank(Scene& scene, uint64_t seed);

}  // namespace comap
