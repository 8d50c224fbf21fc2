// How far the camera has turned between two pictures, from their grey values alone: no depth, no translation. A start
// for the full alignment when the camera turns faster than constant velocity foresees.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "protocol/types/camera.h"
#include "protocol/types/image.h"

namespace comap {

struct RotationOptions {
  int iterations = 10;          ///< at most, on each level
  int narrowest_px = 20;        ///< pictures are halved down to this width, so that large turns are found
  double stop_px = 0.05;        ///< a step that moves the picture by less ends a level
  double gain_prior_grey = 20;  ///< contrast at which the data and "equal exposure" say the same about the gain
  // A result is usable if it passes all of these.
  double overlap = 0.5;                  ///< share of the previous picture that the current one still sees
  double explained = 0.5;                ///< mean_error / mean deviation of the previous picture; more is no match
  double weakest_grey_per_degree = 0.4;  ///< rms change of grey by a turn about the least determined axis
};

struct RotationAlignment {
  Eigen::Matrix3d R_previous_current = Eigen::Matrix3d::Identity();
  double mean_error = 255;   ///< mean |difference| of grey levels after gain and bias, where both see; 40 at most each
  double start_error = 255;  ///< the same at the guess
  double overlap = 0;
  double weakest_grey_per_degree = 0;
  bool usable = false;  ///< otherwise R_previous_current is the guess
};

/// Buffers kept by the caller: nothing is allocated from the second call with pictures of one size on.
struct RotationWorkspace {
  struct Level {
    CameraModel camera;
    Image<float> previous, current;
  };
  std::vector<Level> halved;  ///< narrowest last
};

/// Row of the residual r = I_current(pi(R_current_previous x)) - I_previous for the left increment
/// R_current_previous <- exp(phi) R_current_previous, radians. (mx, my, 1) is the ray in the current camera, (gx, gy)
/// the gradient there in grey levels a pixel. With q = R x and h = dr/dq: dr = h . (phi x q) = phi . (q x h), in which
/// the depth of q cancels.
template <class Scalar>
std::array<Scalar, 3> rotationJacobian(Scalar mx, Scalar my, Scalar gx, Scalar gy, Scalar fx, Scalar fy) {
  const Scalar a = gx * fx, b = gy * fy, c = -(a * mx + b * my);
  return {my * c - b, a - mx * c, mx * b - my * a};
}

/// Aligns two grey pictures (0..255) of one camera by a rotation, coarse to fine, from `R_guess` (previous from
/// current) and from no rotation, whichever fits better. Pictures that do not have the camera's size are not usable.
/// Thread rule: one workspace, one thread.
RotationAlignment alignRotation(const CameraModel& camera, const Image<float>& previous, const Image<float>& current,
                                const Eigen::Matrix3d& R_guess, const RotationOptions& options,
                                RotationWorkspace& workspace);

}  // namespace comap
