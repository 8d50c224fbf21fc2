#include "fleet_tools/store/record_json.h"

#include <cstdio>

namespace comap {

nlohmann::json jsonOf(const Pose& pose) {
  const Eigen::Vector3d& t = pose.translation();
  const Eigen::Quaterniond& q = pose.rotation();
  return {{"translation_m", {t.x(), t.y(), t.z()}}, {"rotation_xyzw", {q.x(), q.y(), q.z(), q.w()}}};
}

std::vector<FailedNumber> failedNumbers(const MatchVerdict& v) {
  if (v.reason == "coarse_alignment" || v.reason == "inlier_ratio") return {{"inlier_ratio", v.inlier_ratio}};
  if (v.reason == "rms_sigma") return {{"rms_sigma", v.rms_sigma}};
  if (v.reason == "degenerate") return {{"degeneracy", v.degeneracy}};
  if (v.reason == "photometric") return {{"photometric_median", v.photometric_median}};
  if (v.reason == "seen_through") return {{"seen_through", v.seen_through}};
  if (v.reason == "unlike") return {{"unlike", v.unlike}};
  if (v.reason == "featureless") return {{"features", v.features}};
  if (v.reason == "contradiction") return {{"contradicted", v.seen_through}};
  if (v.reason == "round_trip") return {{"round_trip_m", v.round_trip_m}, {"round_trip_rad", v.round_trip_rad}};
  return {};
}

nlohmann::json jsonOf(const MatchVerdict& v) {
  nlohmann::json failed = nlohmann::json::object();
  for (const FailedNumber& number : failedNumbers(v)) failed[number.name] = number.value;
  return {{"query", toString(v.query)},
          {"candidate", toString(v.candidate)},
          {"accepted", v.accepted},
          {"reason", v.reason},
          {"failed", failed},
          {"fern_dissimilarity", v.fern_dissimilarity},
          {"inlier_ratio", v.inlier_ratio},
          {"rms_sigma", v.rms_sigma},
          {"degeneracy", v.degeneracy},
          {"photometric_median", v.photometric_median},
          {"seen_through", v.seen_through},
          {"unlike", v.unlike},
          {"features", v.features},
          {"round_trip_m", v.round_trip_m},
          {"round_trip_rad", v.round_trip_rad},
          {"T_candidate_query", jsonOf(v.T_candidate_query)}};
}

nlohmann::json jsonOf(const MergeRecord& m) {
  nlohmann::json voters = nlohmann::json::array();
  for (const KeyframeId& voter : m.voters) voters.push_back(toString(voter));
  return {{"number", m.number},
          {"kept", m.kept},
          {"absorbed", m.absorbed},
          {"robots", m.robots},
          {"voters", voters},
          {"keyframes_ingested", m.keyframes_ingested},
          {"undone", m.undone.empty() ? nlohmann::json() : nlohmann::json(m.undone)},
          {"T_kept_absorbed", jsonOf(m.T_kept_absorbed)}};
}

void printJson(const nlohmann::json& document) {
  const std::string text = document.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
  std::printf("%s\n", text.c_str());
}

}  // namespace comap
