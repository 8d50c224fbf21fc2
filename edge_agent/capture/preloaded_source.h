// A recording held in memory, so that reading it takes nothing from what is measured while it plays.
#pragma once

#include <functional>
#include <memory>

#include "edge_agent/capture/frame_source.h"

namespace comap {

/// Reads the source to its end, and gives the same frames and errors in the same order. kWrongUse for a camera, for a
/// source of unknown length, and if the frames would take more than half of the memory that is free. `stopped` ends the
/// reading early: what has been read is given.
Result<std::unique_ptr<FrameSource>> preload(std::unique_ptr<FrameSource> source, const std::function<bool()>& stopped);

/// The same with a bound of one's own on the frames' bytes.
Result<std::unique_ptr<FrameSource>> preload(std::unique_ptr<FrameSource> source, const std::function<bool()>& stopped,
                                             uint64_t most_bytes);

}  // namespace comap
