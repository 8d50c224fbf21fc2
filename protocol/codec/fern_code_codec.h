// Fern codes inside keyframes: 4 bits a fern and a validity mask. Inside the codec only.
#pragma once

#include "comap/v1/keyframe.pb.h"
#include "protocol/types/keyframe.h"
#include "protocol/types/result.h"

namespace comap::codec {

/// kWrongUse for more than kMaxFerns ferns or a code that is neither 0..15 nor kBad.
Result<void> write(const FernCode& code, v1::FernCode* to);
/// kBadData for lists of other lengths than `count` tells.
Result<FernCode> readFernCode(const v1::FernCode& from);

}  // namespace comap::codec
