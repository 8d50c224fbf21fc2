// The part of Agent that speaks with the core: what it says, and what it does with what it hears.
#include <algorithm>
#include <nlohmann/json.hpp>

#include "edge_agent/agent.h"
#include "protocol/codec/codec.h"
#include "protocol/codec/version.h"
#include "protocol/telemetry/stage_clock.h"

namespace comap {
namespace {

using Json = nlohmann::json;

constexpr double kInterestShare = 0.1;  // of the uplink, for telling which tiles are held
constexpr std::chrono::seconds kHelloPeriod{1}, kStatusPeriod{1};
constexpr std::chrono::seconds kInterestPeriod{2};  // at most, without frames too

// Only for a trace.
void noteHeld(const TileKey& key, uint64_t revision) {
  if (!StageClock::process().traces()) return;
  StageClock::process().note("tile held",
                             Json{{"map", key.map}, {"tile", {key.x, key.y, key.z}}, {"revision", revision}}.dump());
}

}  // namespace

Result<void> Agent::hello() {
  const auto encoded = encodeHello({config_.robot, session_, book_.hash(), COMAP_VERSION});
  if (!encoded) return encoded.error();
  last_hello_ = std::chrono::steady_clock::now();
  return link_.publish(Topic::kHello, config_.robot, *encoded);
}

// A hello may be lost with a core or a link that ended; a robot that is not heard of may be taken for one that ended.
void Agent::keepInTouch(std::chrono::steady_clock::time_point now) {
  const bool peer = link_.peers() > 0;
  if (peer && (!had_peer_ || !welcome_) && now - last_hello_ >= kHelloPeriod) {
    if (!hello()) return;  // again after the next period
  }
  had_peer_ = peer;
  if (now - last_status_ >= kStatusPeriod) sendStatus(finished_);
  // Others change the map also while this camera gives nothing.
  if (now - last_interest_ >= kInterestPeriod) sendInterest();
}

std::chrono::duration<double> Agent::stalled() const {
  return waits_since_ ? std::chrono::steady_clock::now() - *waits_since_ : std::chrono::duration<double>(0);
}

void Agent::noteWaiting(size_t before) {
  const size_t waiting = sender_.waitingInAll();
  if (waiting == 0)
    waits_since_.reset();
  else if (waiting < before || !waits_since_)
    waits_since_ = std::chrono::steady_clock::now();
}

Result<void> Agent::exchange(std::chrono::milliseconds timeout) {
  const size_t waiting = sender_.waitingInAll();
  keepInTouch(std::chrono::steady_clock::now());
  if (welcome_) sender_.sendDue(std::chrono::steady_clock::now());
  auto delivery = link_.receive(timeout);
  while (delivery) {
    if (auto handled = handle(*delivery); !handled) return handled;
    delivery = link_.receive(std::chrono::milliseconds(0));
  }
  noteWaiting(waiting);
  sender_.tellLosses(std::chrono::steady_clock::now());
  sender_.tryDisk(std::chrono::steady_clock::now());
  if (welcome_) sender_.sendDue(std::chrono::steady_clock::now());
  return {};
}

Result<void> Agent::handle(const Delivery& delivery) {
  const auto refuse = [&](const Error& error) {
    log_("message passed over: " + error.text);
    return Result<void>{};
  };
  switch (delivery.topic) {
    case Topic::kAck: {
      const auto ack = decodeAcknowledgement(delivery.payload);
      if (const std::string other = otherProtocol(delivery.payload); !other.empty())
        return Error{ErrorCode::kProblem, "the core speaks " + other};
      if (!ack) return refuse(ack.error());
      if (ack->session == 0 && !ack->refusal.empty() && !welcome_)  // it could not read who we are
        return Error{ErrorCode::kProblem, "the core refuses robot " + config_.robot + ": " + ack->refusal};
      if (ack->session != session_) {  // of this robot's earlier life
        sender_.acknowledge(*ack, std::chrono::steady_clock::now());
        return {};
      }
      if (!ack->refusal.empty())
        return Error{ErrorCode::kProblem, "the core refuses robot " + config_.robot + ": " + ack->refusal};
      if (ack->next_expected < durable_below_)
        return Error{ErrorCode::kProblem, "the core holds " + std::to_string(ack->next_expected) + " of the " +
                                              std::to_string(durable_below_) +
                                              " keyframes it acknowledged: it was started anew; start this agent anew"};
      durable_below_ = ack->next_expected;
      welcome_ = true;
      sender_.acknowledge(*ack, std::chrono::steady_clock::now());
      mapped_below_ = std::max(mapped_below_, ack->mapped_below);
      return {};
    }
    case Topic::kCorrection: {
      const auto correction = decodeCorrection(delivery.payload);
      if (!correction) return refuse(correction.error());
      if (correction->session != session_ || (correction_ && correction->revision <= correction_->revision)) return {};
      if (!correction_ || correction_->map != correction->map) log_("now in map " + correction->map);
      correction_ = *correction;
      const MapId map_before = localizer_.tiles().map();
      localizer_.correct(*correction, mapped_below_);
      if (localizer_.tiles().map() != map_before) sendInterest();  // none of its tiles are held, and the core may go
      return {};
    }
    case Topic::kTile: {
      auto tile = decodeTile(delivery.payload);
      if (!tile) return refuse(tile.error());
      const TileKey key = tile->key;
      const uint64_t revision = tile->revision;
      if (localizer_.put(std::move(*tile), delivery.payload)) {
        noteHeld(key, revision);
        ++statistics_.tiles_received;
        statistics_.tile_bytes_received += delivery.payload.size();
      }
      return {};
    }
    default:
      return {};
  }
}

void Agent::sendInterest() {
  const auto now = std::chrono::steady_clock::now();
  last_interest_ = now;
  if (!welcome_ || now < next_interest_) return;
  Interest interest;
  interest.robot = config_.robot;
  interest.session = session_;
  interest.T_odom_cam = T_odom_cam_;
  interest.radius_m = localizer_.interestRadius(config_.interest_radius_m);
  interest.budget_bytes_per_s = config_.downlink_bytes_per_s;
  interest.held = localizer_.tiles().held();
  interest.at = localizer_.interestAt();
  const auto encoded = encodeInterest(interest);
  if (!encoded || !link_.publish(Topic::kInterest, config_.robot, *encoded)) return;  // no room: the next one says it
  const double uplink = sender_.uplinkBytesPerSecond();
  if (!config_.sender.send.paced || uplink <= 0) return;
  next_interest_ = now + std::chrono::duration_cast<std::chrono::steady_clock::duration>(std::chrono::duration<double>(
                             static_cast<double>(encoded->size()) / (kInterestShare * uplink)));
}

void Agent::sendStatus(bool finished) {
  finished_ = finished;
  last_status_ = std::chrono::steady_clock::now();
  if (!welcome_) return;
  Status status;
  status.robot = config_.robot;
  status.session = session_;
  status.stamp_ns = statistics_.last_stamp_ns;
  status.T_odom_cam = T_odom_cam_;
  status.tracking = state_;
  status.frames = statistics_.frames;
  status.keyframes = statistics_.keyframes;
  status.outbox = unacknowledged();
  status.finished = finished;
  status.outbox_bytes = sender_.waitingBytes();
  status.keyframes_thinned = sender_.losses().thinned;
  status.keyframes_dropped = sender_.losses().dropped;
  status.keyframes_refused = static_cast<uint32_t>(sender_.refused().size());
  status.refused = sender_.refusedToTell();
  if (const auto encoded = encodeStatus(status)) (void)link_.publish(Topic::kStatus, config_.robot, *encoded);
}

}  // namespace comap
