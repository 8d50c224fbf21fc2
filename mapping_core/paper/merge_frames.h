// Putting two maps of the paper mode together rigidly.
#pragma once

#include "mapping_core/paper/reference_frame.h"

namespace comap {

/// `absorbed` lies at T_kept_absorbed in `kept`, which takes all that it holds and the cameras that move in it
/// (`absorbed_index`), with their histories. Errors are those of the device.
Result<void> mergeFrames(ReferenceFrame& kept, size_t kept_index, ReferenceFrame& absorbed, size_t absorbed_index,
                         const Pose& T_kept_absorbed, std::vector<PaperCamera>& cameras, uint32_t tick);

}  // namespace comap
