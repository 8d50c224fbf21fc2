// An accepted place match: what will be an edge, and until then is a vote.
#pragma once

#include <map>

#include "protocol/types/ids.h"
#include "protocol/types/pose.h"

namespace comap {

struct Closure {
  KeyframeId query, candidate;
  Pose T_candidate_query;
  /// Of T_candidate_query for the left increment, order (rho, phi).
  Matrix6d information = Matrix6d::Identity();
};

/// Where the query's keyframe would stand in the candidate's map if `closure` is right.
inline Pose queryInCandidateMap(const Closure& closure, const std::map<KeyframeId, Pose>& T_map_cam) {
  return T_map_cam.at(closure.candidate) * closure.T_candidate_query;
}

}  // namespace comap
