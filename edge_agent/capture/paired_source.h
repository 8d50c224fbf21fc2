// A live camera as a frame source: any colour stream with any depth stream.
#pragma once

#include <memory>
#include <string>

#include "edge_agent/capture/camera_rig.h"
#include "edge_agent/capture/capture_log.h"
#include "edge_agent/capture/frame_source.h"
#include "edge_agent/capture/live_stream.h"

namespace comap {

struct PairedOptions {
  CameraRig rig;
  bool depth_is_registered = false;  ///< by the device: depth pictures are as seen by the colour camera
  int shrink = 1;                    ///< frames 1, 2 or 4 times smaller than colour pictures
  int64_t max_gap_ns = 20'000'000;   ///< between the two pictures of a frame
  double hot_C = 0;                  ///< from here on fewer frames are taken (HeatRule); 0: however hot it is
  std::string thermal_folder = {};   ///< where the kernel tells temperatures
  LiveStreamOptions stream;
  CaptureLog log;  ///< told when a stream stalls, goes or comes back
};

/// Opens both devices, or says why not (the openers' errors; kWrongUse for a rig without focal lengths). From then on a
/// device that goes is waited for. next() waits for the newest pair; frames it could not take in time are left out, and
/// counted (health). Stamps are the colour pictures', as time since 1970 that does not follow later changes of the
/// system's clock. A pair with a damaged picture is an error of next(), which may be asked again.
Result<std::unique_ptr<FrameSource>> openPaired(StreamOpener colour, StreamOpener depth, PairedOptions options);

}  // namespace comap
