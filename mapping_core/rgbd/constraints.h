// Which directions of the camera's motion the surfaces in two views really determine. Noise tilts normals, and so seems
// to hold a camera in front of a blank wall. But the noise of two views is not the same: the product of what one view
// shows with what the other shows has no noise in its mean.
#pragma once

#include "mapping_core/rgbd/point_residuals.h"
#include "mapping_core/rgbd/pyramid.h"
#include "mapping_core/rgbd/reference_view.h"
#include "protocol/types/pose.h"

namespace comap {

/// Like sumNormalEquations().a, but each geometric row once with the reference's normal and once with the frame's,
/// symmetrised, and photometric rows with the reference's gradient. Uses the weights of the points' last evaluation at
/// a pose near T_ref_cur; `extra_sigma_m` is that of its gates. May have small negative eigenvalues: not determined.
Matrix6d sumConstraints(const ReferencePoints& points, const PyramidLevel& frame, const Pose& T_ref_cur,
                        const DepthNoiseModel& noise, float extra_sigma_m, const PointResiduals& residuals);

}  // namespace comap
