// How far the camera has turned between two pictures, from their grey values alone: no depth, no translation. A start
// for the full alignment when the camera turns faster than constant velocity foresees.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "protocol/types/camera.h"
#include "protocol/types/image.h"

namespace comap {

struct RotationOptions {
  int iterations = 10;          ///< at most, on each level
  int narrowest_px = 20;        ///< pictures are halved down to this width, so that large turns are found
  double stop_px = 0.02;        ///< a step that moves the picture by less ends a level
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

/// Row of the residual r = I_current(pi(R_current_previous x)) - I_previous for the right increment
/// R_current_previous <- R_current_previous exp(phi), radians. `x_previous` is the ray through the pixel, `gradient` in
/// grey levels a pixel at the point where it ends. q = R x, h = dr/dq, r' = h . (R (phi x x)) = phi . (x x R^T h).
template <class Scalar>
Eigen::Matrix<Scalar, 1, 3> rotationJacobian(const Eigen::Matrix<Scalar, 3, 1>& x_previous,
                                             const Eigen::Matrix<Scalar, 3, 3>& R_current_previous,
                                             const Eigen::Matrix<Scalar, 2, 1>& gradient, Scalar fx, Scalar fy) {
  const Eigen::Matrix<Scalar, 3, 1> q = R_current_previous * x_previous;
  const Scalar iz = 1 / q.z(), a = gradient.x() * fx * iz, b = gradient.y() * fy * iz;
  const Eigen::Matrix<Scalar, 3, 1> h(a, b, -(a * q.x() + b * q.y()) * iz);
  const Eigen::Matrix<Scalar, 3, 1> v = R_current_previous.transpose() * h;
  return x_previous.cross(v).transpose();
}

/// Aligns two grey pictures (0..255) of one camera by a rotation, coarse to fine, from `R_guess` (previous from
/// current) and from no rotation, whichever fits better. Pictures that do not have the camera's size are not usable.
/// Thread rule: one workspace, one thread.
RotationAlignment alignRotation(const CameraModel& camera, const Image<float>& previous, const Image<float>& current,
                                const Eigen::Matrix3d& R_guess, const RotationOptions& options,
                                RotationWorkspace& workspace);

}  // namespace comap
