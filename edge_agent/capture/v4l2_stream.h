// Pictures from a video device of the Linux kernel (V4L2), through memory that driver and program share.
#pragma once

#include <memory>
#include <string>

#include "edge_agent/capture/picture_stream.h"
#include "edge_agent/capture/video_calls.h"

namespace comap {

/// Opens `path`, sets mode and controls, starts. kUnreachable if it is not there, busy or fails; kWrongUse if it does
/// not offer what is wanted (mode or control), and says what it offers instead. `calls` must outlive the stream.
Result<std::unique_ptr<PictureStream>> openV4l2(VideoCalls& calls, const std::string& path, const VideoWish& wish,
                                                const VideoControls& controls);

}  // namespace comap
