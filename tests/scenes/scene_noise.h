// What a real sensor adds to an exact frame.
#pragma once

#include <cstdint>

#include "protocol/types/image.h"

namespace comap {

/// Structured-light depth noise: lateral jitter of half a pixel and disparity rounded to a grid (1.1 cm steps at 2 m),
/// and two grey levels of colour noise. The same seed gives the same frame.
void addKinectNoise(Frame& frame, uint64_t seed);

/// Another exposure: colour <- gain colour + bias, clipped to 0..255.
void changeExposure(Frame& frame, double gain, double bias);

}  // namespace comap
