// A keyframe at half its size: what a core that falls behind can fuse in a third of the time.
#pragma once

#include "protocol/types/keyframe.h"

namespace comap {

/// What fusion needs of it, shrunk by 2 in both directions: camera, pictures and how many frames agreed. Colour: means.
/// Depth: mean of those of 2x2 that lie on the surface of the nearest of them, so that edges stay edges.
Keyframe halved(const Keyframe& keyframe);

}  // namespace comap
