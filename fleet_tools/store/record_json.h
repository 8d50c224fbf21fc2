// Records of a store as JSON with stable keys.
#pragma once

#include <nlohmann/json.hpp>

#include "protocol/types/messages.h"

namespace comap {

/// What a verdict was refused for, in numbers.
struct FailedNumber {
  const char* name;
  double value;
};
/// The numbers that its reason is about; none for "accepted" and for reasons whose numbers a verdict does not carry.
std::vector<FailedNumber> failedNumbers(const MatchVerdict& verdict);

/// {"translation_m": [x, y, z], "rotation_xyzw": [...]}
nlohmann::json jsonOf(const Pose& pose);
nlohmann::json jsonOf(const MatchVerdict& verdict);
nlohmann::json jsonOf(const MergeRecord& merge);

/// Prints one document to stdout; invalid UTF-8 is replaced, numbers that are not finite become null.
void printJson(const nlohmann::json& document);

}  // namespace comap
