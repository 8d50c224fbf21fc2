// Logs of Logger2 and ElasticFusion.
#pragma once

#include <memory>
#include <string>

#include "edge_agent/capture/camera_config.h"
#include "edge_agent/capture/tum_source.h"

namespace comap {

/// Opens a .klg: int32 number of frames, then for each int64 stamp (microseconds), int32 bytes of depth, int32 bytes of
/// colour, depth (16-bit values, compressed by zlib or as they are), colour (JPEG, or RGB as it is); low byte first. It
/// tells neither size nor calibration: both are `camera.colour`, and depth counts `camera.depth_units_per_m` and is
/// taken for registered unless `camera.registration` is software. Stamps that do not grow are frame numbers at 30 a
/// second from the first one. kUnreachable: no such file; kBadData: its index is damaged (frames after that place do
/// not count if it is merely cut off); kWrongUse: no focal lengths, a range outside. A damaged picture is an error of
/// next().
Result<std::unique_ptr<FrameSource>> openKlg(const std::string& path, TumRange range, const CameraConfig& camera);

}  // namespace comap
