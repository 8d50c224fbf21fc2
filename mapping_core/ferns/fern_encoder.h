// A frame's fern code.
#pragma once

#include "mapping_core/ferns/fern_book.h"
#include "protocol/types/keyframe.h"

namespace comap {

/// Encodes an RGB-D pair of any size: shrunk to 80x60 (colour by area means, depth by the median of valid samples),
/// brightness scaled to a common mean so that exposure does not flip bits.
FernCode encodeFerns(const FernBook& book, const ColourImage& colour, const DepthImage& depth);

}  // namespace comap
