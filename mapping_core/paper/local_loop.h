// A local loop of one camera: its active part of the map is registered to the inactive part it looks at, and bent onto
// it.
#pragma once

#include "mapping_core/paper/loop_context.h"

namespace comap {

/// `active` is what the camera predicts from its pose now. If the loop closes, map, places and camera have moved, and
/// what it now sees is active for this camera alone. Errors are those of the device.
Result<LoopReport> closeLocalLoop(const LoopContext& context, const TimedView& active);

}  // namespace comap
