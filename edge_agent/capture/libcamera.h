// Colour from the cameras that libcamera drives.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "edge_agent/capture/picture_stream.h"

namespace comap {

/// Whether this build can. If not, the other functions here refuse (kUnreachable) and say what is missing.
bool hasLibcamera();

/// Opens the camera `id`, or the only one if `id` is empty. kUnreachable if it is not there or another program has it;
/// kWrongUse if it does not offer what is wanted (mode or control), and says what it offers instead.
Result<std::unique_ptr<PictureStream>> openLibcamera(const std::string& id, const VideoWish& wish,
                                                     const VideoControls& controls);

/// One line a camera found, and what it offers indented below.
std::vector<std::string> libcameraFound();

}  // namespace comap
