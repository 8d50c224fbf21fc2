// A store as a recording for programs that play them (Foxglove and others): what the robots saw, where they were, when
// their maps became one, and the map.
#pragma once

#include <functional>
#include <string>

#include "mapping_core/store/map_store.h"

namespace comap {

struct RecordingCounts {
  size_t poses = 0, pictures = 0, points = 0, events = 0;
};

/// Writes an MCAP file of Foxglove's Protobuf schemas, at the robots' own times. Topics: /ROBOT/pose (PoseInFrame),
/// /ROBOT/path (PosesInFrame, at its end), /ROBOT/picture (CompressedImage) and /ROBOT/camera (CameraCalibration) in
/// frame "ROBOT", which /tf (FrameTransform) ties to its map; /MAP/points (PointCloud) from the beginning; /events
/// (Log): merges and accepted matches between robots. `map`: of this map alone; all if empty. `progress` (may be empty)
/// hears (done, all) keyframes. kUnreachable if it cannot be written, kBadData for what the store should not hold.
Result<RecordingCounts> writeRecording(const MapStore& store, const std::string& path, const MapId& map,
                                       const std::function<void(size_t, size_t)>& progress);

}  // namespace comap
