// From the two pictures that a camera delivers to one frame.
#pragma once

#include "edge_agent/capture/camera_rig.h"
#include "edge_agent/capture/depth_registration.h"
#include "edge_agent/capture/pair_matcher.h"
#include "edge_agent/capture/undistort.h"
#include "protocol/types/result.h"

namespace comap {

/// Decodes, undistorts, registers and scales. Thread rule: one thread.
class FrameMaker {
 public:
  /// Frames are those of the colour lens' pinhole, `shrink` (1, 2, 4) times smaller by averaging.
  FrameMaker(const CameraRig& rig, bool depth_is_registered, int shrink);

  /// Its stamp is the colour picture's. kBadData if a picture is damaged or of another size than the rig says.
  Result<Frame> make(const PicturePair& pair);

  const CameraModel& camera() const { return camera_; }

 private:
  Lens colour_;
  int shrink_;
  CameraModel camera_;
  Undistorter undistorter_;
  DepthRegistration registration_;
};

}  // namespace comap
