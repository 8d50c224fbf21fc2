#include "protocol/codec/merge_record_codec.h"

#include "comap/v1/merge.pb.h"
#include "protocol/codec/checks.h"
#include "protocol/codec/envelope.h"
#include "protocol/codec/geometry_codec.h"
#include "protocol/codec/limits.h"

namespace comap {
namespace {

codec::Check check(const MergeRecord& merge) {
  codec::Check check("merge");
  check.map("kept", merge.kept)
      .map("absorbed", merge.absorbed)
      .pose("T_kept_absorbed", merge.T_kept_absorbed)
      .count("robots", merge.robots.size(), kMaxMergeRobots)
      .count("voters", merge.voters.size(), kMaxMergeVoters)
      .text("undone", merge.undone);
  if (!check.ok()) return check;
  for (const std::string& robot : merge.robots) check.robot("robots", robot);
  for (const KeyframeId& voter : merge.voters) check.id("voters", voter);
  return check;
}

}  // namespace

Result<std::vector<uint8_t>> encodeMergeRecord(const MergeRecord& merge) {
  if (const auto checked = check(merge); !checked.ok()) return checked.error(ErrorCode::kWrongUse);
  v1::MergeRecord message;
  message.set_number(merge.number);
  message.set_kept(merge.kept);
  message.set_absorbed(merge.absorbed);
  codec::write(merge.T_kept_absorbed, message.mutable_t_kept_absorbed());
  for (const std::string& robot : merge.robots) message.add_robots(robot);
  for (const KeyframeId& voter : merge.voters) codec::write(voter, message.add_voters());
  message.set_keyframes_ingested(merge.keyframes_ingested);
  message.set_undone(merge.undone);
  return codec::serialise(message, "merge", kMaxListMessageBytes);
}

Result<MergeRecord> decodeMergeRecord(std::span<const uint8_t> bytes) {
  const auto message = codec::parse<v1::MergeRecord>(bytes, "merge", kMaxListMessageBytes);
  if (!message) return message.error();
  const auto pose = codec::readPose(message->t_kept_absorbed(), "merge: T_kept_absorbed");
  if (!pose) return pose.error();
  const auto sized = codec::Check("merge")
                         .count("robots", static_cast<size_t>(message->robots_size()), kMaxMergeRobots)
                         .count("voters", static_cast<size_t>(message->voters_size()), kMaxMergeVoters);
  if (!sized.ok()) return sized.error(ErrorCode::kBadData);
  MergeRecord merge{
      message->number(), message->kept(), message->absorbed(), *pose, {}, {}, message->keyframes_ingested(),
      message->undone()};
  merge.robots.assign(message->robots().begin(), message->robots().end());
  for (const v1::KeyframeId& voter : message->voters()) merge.voters.push_back(codec::readId(voter));
  if (const auto checked = check(merge); !checked.ok()) return checked.error(ErrorCode::kBadData);
  return merge;
}

}  // namespace comap
