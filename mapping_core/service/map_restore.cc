// A builder filled from its store: what is derived is derived anew.
#include <algorithm>
#include <utility>

#include "mapping_core/service/map_builder.h"
#include "protocol/codec/keyframe_codec.h"

namespace comap {
namespace {

using Pair = std::pair<KeyframeId, KeyframeId>;

Pair pairOf(const KeyframeId& a, const KeyframeId& b) { return {std::min(a, b), std::max(a, b)}; }

}  // namespace

Result<void> MapBuilder::restore() {
  const auto keyframes = store_.keyframes();
  if (!keyframes) return keyframes.error();
  const auto robots = store_.robots();
  if (!robots) return robots.error();
  std::map<std::string, uint32_t> robot_index;
  for (const std::string& robot : *robots) robot_index.emplace(robot, static_cast<uint32_t>(robot_index.size()));

  for (const StoredKeyframe& stored : *keyframes) {
    if (stored.map.empty()) continue;  // durable, but not yet mapped
    const auto robot = robot_index.find(stored.id.robot);
    if (robot == robot_index.end())
      return Error{ErrorCode::kBadData, "keyframe " + toString(stored.id) + " in the store is of no known robot"};
    const auto encoded = store_.encodedKeyframe(stored.id);
    if (!encoded) return encoded.error();
    const auto keyframe = decodeKeyframeWithoutImages(*encoded);
    if (!keyframe) return keyframe.error();
    const auto index = static_cast<uint32_t>(by_index_.size());
    index_[stored.id] = index;
    surfels_.know(stored.id, index, robot->second);
    by_index_.push_back(stored.id);
    const auto code = codeOf(*keyframe);
    if (!code) return code.error();
    if (!search_.add(stored.id, *code))
      return Error{ErrorCode::kBadData, "keyframe " + toString(stored.id) + ": fern code has not the book's size"};
  }

  const auto merges = store_.merges();
  if (!merges) return merges.error();
  for (const MergeRecord& merge : *merges) merges_ = std::max(merges_, merge.number);
  const auto withdrawn = store_.withdrawnEdges();
  if (!withdrawn) return withdrawn.error();
  // A merge may be forgotten while edges still name it: its number is never used again.
  for (const WithdrawnEdge& one : *withdrawn) merges_ = std::max(merges_, one.withdrawn_by);
  auto standing = readStanding();
  if (!standing) return standing.error();
  const std::vector<KeyframeId> anchors = standing->components.anchors();
  auto transaction = store_.begin();
  if (!transaction) return transaction.error();
  if (auto reshaped = reshape(std::move(*standing), {anchors.begin(), anchors.end()}); !reshaped) return reshaped;
  if (auto committed = transaction->commit(); !committed) return committed;
  if (auto votes = restoreVotes(); !votes) return votes;
  const auto wait = store_.votesWait();
  if (!wait) return wait.error();
  recast_due_ = *wait;
  return watchStanding();
}

// Accepted, but no edge, neither one that holds nor one that was withdrawn, and not refused as a vote: still one. Those
// that have a rival wait.
Result<void> MapBuilder::restoreVotes() {
  std::set<Pair> decided;
  for (const Edge& edge : edges_)
    if (edge.kind != EdgeKind::kOdometry) decided.insert(pairOf(edge.from, edge.to));
  const auto withdrawn = store_.withdrawnEdges();
  if (!withdrawn) return withdrawn.error();
  for (const WithdrawnEdge& one : *withdrawn) decided.insert(pairOf(one.edge.from, one.edge.to));
  const auto refusals = store_.verdicts({false, "contradiction", ""});
  if (!refusals) return refusals.error();
  for (const MatchVerdict& refusal : *refusals) decided.insert(pairOf(refusal.query, refusal.candidate));
  const auto verdicts = store_.verdicts({true, "", ""});
  if (!verdicts) return verdicts.error();
  for (const MatchVerdict& verdict : *verdicts) {
    if (!index_.contains(verdict.query) || !index_.contains(verdict.candidate)) continue;
    if (decided.contains(pairOf(verdict.query, verdict.candidate))) continue;
    votes_.keep({verdict.query, verdict.candidate, verdict.T_candidate_query, verdict.information});
  }
  return {};
}

}  // namespace comap
