#include "protocol/codec/match_verdict_codec.h"

#include "comap/v1/verdict.pb.h"
#include "protocol/codec/checks.h"
#include "protocol/codec/envelope.h"
#include "protocol/codec/geometry_codec.h"
#include "protocol/codec/limits.h"

namespace comap {
namespace {

codec::Check check(const MatchVerdict& verdict) {
  return codec::Check("verdict")
      .id("query", verdict.query)
      .id("candidate", verdict.candidate)
      .text("reason", verdict.reason)
      .finite("fern_dissimilarity", verdict.fern_dissimilarity)
      .finite("inlier_ratio", verdict.inlier_ratio)
      .finite("rms_sigma", verdict.rms_sigma)
      .finite("degeneracy", verdict.degeneracy)
      .finite("photometric_median", verdict.photometric_median)
      .finite("seen_through", verdict.seen_through)
      .finite("unlike", verdict.unlike)
      .finite("features", verdict.features)
      .finite("round_trip_m", verdict.round_trip_m)
      .finite("round_trip_rad", verdict.round_trip_rad)
      .pose("T_candidate_query", verdict.T_candidate_query)
      .information("information", verdict.information);
}

}  // namespace

Result<std::vector<uint8_t>> encodeMatchVerdict(const MatchVerdict& verdict) {
  if (const auto checked = check(verdict); !checked.ok()) return checked.error(ErrorCode::kWrongUse);
  v1::MatchVerdict message;
  codec::write(verdict.query, message.mutable_query());
  codec::write(verdict.candidate, message.mutable_candidate());
  message.set_accepted(verdict.accepted);
  message.set_reason(verdict.reason);
  message.set_fern_dissimilarity(verdict.fern_dissimilarity);
  message.set_inlier_ratio(verdict.inlier_ratio);
  message.set_rms_sigma(verdict.rms_sigma);
  message.set_degeneracy(verdict.degeneracy);
  message.set_photometric_median(verdict.photometric_median);
  message.set_seen_through(verdict.seen_through);
  message.set_unlike(verdict.unlike);
  message.set_features(verdict.features);
  message.set_round_trip_m(verdict.round_trip_m);
  message.set_round_trip_rad(verdict.round_trip_rad);
  codec::write(verdict.T_candidate_query, message.mutable_t_candidate_query());
  codec::write(verdict.information, message.mutable_information());
  return codec::serialise(message, "verdict", kMaxSmallMessageBytes);
}

Result<MatchVerdict> decodeMatchVerdict(std::span<const uint8_t> bytes) {
  const auto message = codec::parse<v1::MatchVerdict>(bytes, "verdict", kMaxSmallMessageBytes);
  if (!message) return message.error();
  const auto pose = codec::readPose(message->t_candidate_query(), "verdict: T_candidate_query");
  if (!pose) return pose.error();
  const auto information = codec::readInformation(message->information(), "verdict: information");
  if (!information) return information.error();
  MatchVerdict verdict;
  verdict.query = codec::readId(message->query());
  verdict.candidate = codec::readId(message->candidate());
  verdict.accepted = message->accepted();
  verdict.reason = message->reason();
  verdict.fern_dissimilarity = message->fern_dissimilarity();
  verdict.inlier_ratio = message->inlier_ratio();
  verdict.rms_sigma = message->rms_sigma();
  verdict.degeneracy = message->degeneracy();
  verdict.photometric_median = message->photometric_median();
  verdict.seen_through = message->seen_through();
  verdict.unlike = message->unlike();
  verdict.features = message->features();
  verdict.round_trip_m = message->round_trip_m();
  verdict.round_trip_rad = message->round_trip_rad();
  verdict.T_candidate_query = *pose;
  verdict.information = *information;
  if (const auto checked = check(verdict); !checked.ok()) return checked.error(ErrorCode::kBadData);
  return verdict;
}

}  // namespace comap
