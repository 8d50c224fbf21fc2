// Fern codes inside messages: 4 bits a fern and a validity mask. Inside the codec only.
#pragma once

#include <string>

#include "comap/v1/common.pb.h"
#include "protocol/types/fern_code.h"
#include "protocol/types/result.h"

namespace comap::codec {

/// kWrongUse for more than kMaxFerns ferns or a code that is neither 0..15 nor kBad.
/// `field` names it in errors.
Result<void> write(const FernCode& code, v1::FernCode* to, const std::string& field);
/// kBadData for lists of other lengths than `count` tells.
Result<FernCode> readFernCode(const v1::FernCode& from, const std::string& field);

}  // namespace comap::codec
