// A global loop: the camera recognises a place of its own map by ferns, far from where it believes to be.
#pragma once

#include "mapping_core/paper/loop_context.h"

namespace comap {

/// Places old enough, or of other cameras, count. If the deformation that brings the camera there satisfies its
/// constraints, map, places, trajectories and camera have moved. Errors are those of the device.
Result<LoopReport> closeGlobalLoop(const LoopContext& context, const FernView& seen);

/// Whether there is any place that a global loop could be closed with.
bool mayCloseGlobalLoop(const LoopContext& context);

}  // namespace comap
