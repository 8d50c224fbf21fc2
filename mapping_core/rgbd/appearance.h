// Do two views that lie on each other also look alike? Places of the same shape differ in what is on their surfaces;
// and what has nothing on it could be anywhere.
#pragma once

#include <cstddef>

#include "mapping_core/rgbd/noise_model.h"
#include "mapping_core/rgbd/pyramid.h"
#include "protocol/types/pose.h"

namespace comap {

struct AppearanceOptions {
  int patch_pixels = 8;
  float texture = 4;   ///< standard deviation of grey in a patch from which on there is something to compare
  float feature = 8;   ///< and from which on there is something that tells places apart
  float alike = 0.4f;  ///< correlation of two patches from which on they may be one; exposure does not matter to it
};

struct Appearance {
  size_t patches = 0;   ///< that both views see, on the same surface
  size_t textured = 0;  ///< in one of them at least
  size_t unlike = 0;    ///< and not in the same way
  size_t features = 0;  ///< in both, strongly

  /// Share of textured patches that do not look alike; 0 if none is textured.
  double unlikeShare() const { return textured > 0 ? static_cast<double>(unlike) / static_cast<double>(textured) : 0; }
  /// Share of patches with a feature; 0 if there is no patch.
  double featureShare() const { return patches > 0 ? static_cast<double>(features) / static_cast<double>(patches) : 0; }
};

/// Compares the grey of two views, level by level of one size; `frame`'s camera stands at T_ref_frame in the
/// reference's. Patches may be off by a pixel.
Appearance compareAppearance(const PyramidLevel& reference, const PyramidLevel& frame, const Pose& T_ref_frame,
                             const DepthNoiseModel& noise, const AppearanceOptions& options = {});

}  // namespace comap
