#include "protocol/codec/interest_codec.h"

#include "comap/v1/interest.pb.h"
#include "protocol/codec/checks.h"
#include "protocol/codec/envelope.h"
#include "protocol/codec/geometry_codec.h"
#include "protocol/codec/limits.h"

namespace comap {
namespace {

codec::Check check(const Interest& interest) {
  codec::Check check("interest");
  check.robot("robot", interest.robot)
      .pose("T_odom_cam", interest.T_odom_cam)
      .range("radius_m", interest.radius_m, 0, kMaxTranslation_m)
      .count("held", interest.held.size(), kMaxHeldTiles);
  if (interest.at) check.map("at.map", interest.at->map).pose("at.T_map_cam", interest.at->T_map_cam);
  if (!check.ok()) return check;
  for (const HeldTile& tile : interest.held) check.map("held.map", tile.key.map);
  return check;
}

}  // namespace

Result<std::vector<uint8_t>> encodeInterest(const Interest& interest) {
  if (const auto checked = check(interest); !checked.ok()) return checked.error(ErrorCode::kWrongUse);
  v1::Interest message;
  message.set_robot(interest.robot);
  message.set_session(interest.session);
  codec::write(interest.T_odom_cam, message.mutable_t_odom_cam());
  message.set_radius_m(interest.radius_m);
  message.set_budget_bytes_per_s(interest.budget_bytes_per_s);
  if (interest.at) codec::write(*interest.at, message.mutable_at());
  v1::HeldTiles* run = nullptr;
  for (const HeldTile& tile : interest.held) {
    if (run == nullptr || run->map() != tile.key.map) {
      run = message.add_held();
      run->set_map(tile.key.map);
    }
    run->add_x(tile.key.x);
    run->add_y(tile.key.y);
    run->add_z(tile.key.z);
    run->add_revision(tile.revision);
  }
  return codec::serialise(message, "interest", kMaxListMessageBytes);
}

Result<Interest> decodeInterest(std::span<const uint8_t> bytes) {
  const auto message = codec::parse<v1::Interest>(bytes, "interest", kMaxListMessageBytes);
  if (!message) return message.error();
  const auto T_odom_cam = codec::readPose(message->t_odom_cam(), "interest: T_odom_cam");
  if (!T_odom_cam) return T_odom_cam.error();
  Interest interest{message->robot(), message->session(), *T_odom_cam, message->radius_m(),
                    message->budget_bytes_per_s()};
  if (message->has_at()) {
    auto at = codec::readMapPose(message->at(), "interest: at");
    if (!at) return at.error();
    interest.at = std::move(*at);
  }
  size_t count = 0;
  for (const v1::HeldTiles& run : message->held()) {
    if (run.y_size() != run.x_size() || run.z_size() != run.x_size() || run.revision_size() != run.x_size()) {
      return Error{ErrorCode::kBadData, "interest: held has lists of different lengths"};
    }
    count += static_cast<size_t>(run.x_size());
  }
  if (const auto sized = codec::Check("interest").count("held", count, kMaxHeldTiles); !sized.ok()) {
    return sized.error(ErrorCode::kBadData);
  }
  interest.held.reserve(count);
  for (const v1::HeldTiles& run : message->held()) {
    if (const auto named = codec::Check("interest").map("held.map", run.map()); !named.ok()) {
      return named.error(ErrorCode::kBadData);
    }
    for (int i = 0; i < run.x_size(); ++i) {
      interest.held.push_back({{run.map(), run.x(i), run.y(i), run.z(i)}, run.revision(i)});
    }
  }
  if (const auto checked = check(interest); !checked.ok()) return checked.error(ErrorCode::kBadData);
  return interest;
}

}  // namespace comap
