// What a sensor makes of exact pictures.
#pragma once

#include "fleet_tools/synth/synth_renderer.h"

namespace comap {

/// Depth in the project's unit, rounded; 0 where it does not fit.
DepthImage exactDepth(const SynthView& view, int threads);

/// Kinect-like: lateral jitter of 0.5 px, disparity steps (z^2 / 351.3 m) with noise of 1/6 step, range 0.4 to 4.5 m,
/// nothing at depth edges nor where the surface is seen at more than 82 degrees. A function of `key` and the view.
DepthImage kinectDepth(const SynthView& view, uint64_t key, int threads);

/// Adds normal noise of 1.2 grey levels to each channel.
void addColourNoise(ColourImage& colour, uint64_t key, int threads);

}  // namespace comap
