// Exposure and gain of a video device.
#pragma once

#include <string>

#include "edge_agent/capture/picture_stream.h"
#include "edge_agent/capture/video_calls.h"

namespace comap {

/// kWrongUse if a control that is asked for is not there, or the value is outside its range, which is then named;
/// kUnreachable if the device refuses.
Result<void> setControls(VideoCalls& calls, int descriptor, const std::string& path, const VideoControls& controls);

}  // namespace comap
