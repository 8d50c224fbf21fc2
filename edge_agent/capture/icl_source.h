// ICL-NUIM sequences as they are distributed.
#pragma once

#include <memory>
#include <string>

#include "edge_agent/capture/tum_source.h"

namespace comap {

/// Opens the TUM-compatible form: rgb/N.png, depth/N.png (5000 to the metre) and associations.txt, which names depth
/// first; without that list, all N from the smallest that both folders have. The calibration is the data set's (fx
/// 481.2, fy -480: y points up), unless the folder has a calibration.txt. Stamps are the list's numbers N as seconds,
/// as in the trajectories distributed with it. Errors as openTum.
Result<std::unique_ptr<FrameSource>> openIcl(const std::string& directory, TumRange range = {});

}  // namespace comap
