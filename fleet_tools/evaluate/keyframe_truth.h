// Where the keyframes of a store truly were.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "mapping_core/store/map_store.h"
#include "protocol/types/messages.h"
#include "protocol/types/result.h"

namespace comap {

/// T_truth_cam of the keyframes that have a truth within 0.02 s. `truths` are trajectory files by robot; their errors.
Result<std::map<KeyframeId, Pose>> keyframeTruth(const std::vector<StoredKeyframe>& keyframes,
                                                 const std::map<std::string, std::string>& truths);

}  // namespace comap
