// Do two depth pictures show the same surfaces? What one camera sees, the other must not look through.
#pragma once

#include "mapping_core/rgbd/noise_model.h"
#include "mapping_core/rgbd/pyramid.h"
#include "protocol/types/pose.h"

namespace comap {

/// Shares of the pixels of `from` that end in the other picture where that has depth.
struct DepthAgreement {
  double seen_through = 0;  ///< the other's surface lies behind: it looks through what should be there
  double agree = 0;         ///< both are the same surface
};

/// Projects every pixel of `from` into `to`. Surfaces farther apart than `gate_m` (or 3 sigma of the depth, if that is
/// more) differ; one that lies in front is taken for an occlusion. {1, 0} if nothing can be compared. A pure function.
DepthAgreement compareDepth(const PyramidLevel& from, const PyramidLevel& to, const Pose& T_from_to, double gate_m,
                            const DepthNoiseModel& noise);

}  // namespace comap
