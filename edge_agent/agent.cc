#include "edge_agent/agent.h"

#include <nlohmann/json.hpp>

#include "edge_agent/keyframes/depth_rounding.h"
#include "edge_agent/keyframes/far_depth.h"
#include "mapping_core/ferns/fern_encoder.h"
#include "protocol/codec/codec.h"
#include "protocol/codec/version.h"
#include "protocol/telemetry/stage_clock.h"

namespace comap {
namespace {

using Json = nlohmann::json;

constexpr double kInterestShare = 0.1;  // of the uplink, for telling which tiles are held
constexpr int kDamagedInARow = 10, kBackwardsInARow = 5;
constexpr std::chrono::seconds kHelloPeriod{1}, kStatusPeriod{1};
constexpr std::chrono::milliseconds kFrameTurn{10};

SenderOptions senderOptions(const AgentConfig& config) {
  SenderOptions options = config.sender;
  options.outbox_quota_bytes = quotaBytes(config.outbox);
  return options;
}

// Only for a trace.
void noteHeld(const TileKey& key, uint64_t revision) {
  if (!StageClock::process().traces()) return;
  StageClock::process().note("tile held",
                             Json{{"map", key.map}, {"tile", {key.x, key.y, key.z}}, {"revision", revision}}.dump());
}

}  // namespace

Agent::Agent(const AgentConfig& config, uint64_t session, Outbox outbox, FrameSource& source, Link& link, Log log,
             Record record)
    : config_(config),
      session_(session),
      source_(source),
      link_(link),
      log_(std::move(log)),
      record_(std::move(record)),
      book_(FernBook::standard(config.fern_seed)),
      odometry_(config.odometry),
      recovery_(config.recovery),
      sender_(link, config.robot, session, senderOptions(config), std::move(outbox), log_),
      localizer_(config.localizer) {}

Result<void> Agent::hello() {
  const auto encoded = encodeHello({config_.robot, session_, book_.hash(), COMAP_VERSION});
  if (!encoded) return encoded.error();
  last_hello_ = std::chrono::steady_clock::now();
  return link_.publish(Topic::kHello, config_.robot, *encoded);
}

Result<std::optional<Frame>> Agent::readFrame() {
  const StageSpan span("read");
  return source_.next();
}

Result<Agent::Progress> Agent::takeFrame() {
  if (sender_.waiting() >= config_.max_waiting_keyframes) return Progress::kWaiting;
  if (!source_.ready(kFrameTurn)) return Progress::kNoFrame;
  auto next = readFrame();
  if (!next) {
    ++statistics_.damaged_frames;
    ++damaged_in_a_row_;
    if (damaged_in_a_row_ >= kDamagedInARow && !source_.live()) return next.error();
    if (damaged_in_a_row_ <= kDamagedInARow) log_("frame passed over: " + next.error().text);
    return Progress::kFrame;
  }
  damaged_in_a_row_ = 0;
  if (!*next) {
    source_ended_ = true;
    if (auto closed = closeKeyframe(); !closed) return closed.error();
    return Progress::kEnded;
  }
  const Frame& frame = **next;
  if (statistics_.frames > 0 && frame.stamp_ns <= statistics_.last_stamp_ns) {
    const std::string jump = "stamp " + std::to_string(frame.stamp_ns) + " ns is not after the one before, " +
                             std::to_string(statistics_.last_stamp_ns) + " ns";
    if (++backwards_in_a_row_ < kBackwardsInARow) {  // overtaken, or twice
      ++statistics_.damaged_frames;
      log_("frame passed over: its " + jump);
      return Progress::kFrame;
    }
    log_("the clock of the source was set back: " + jump + "; goes on with the new time");
    statistics_.first_stamp_ns += frame.stamp_ns - statistics_.last_stamp_ns;  // so that the duration stays true
  }
  backwards_in_a_row_ = 0;

  const auto start = std::chrono::steady_clock::now();
  TrackedFrame tracked = odometry_.track(frame);
  if (tracked.first && statistics_.keyframes > 0) findBack(frame, tracked);
  if (!tracked.first) searchMap(frame, tracked);
  const auto tracked_at = std::chrono::steady_clock::now();
  const uint32_t registered = localizer_.statistics().attempts;
  localizer_.track(odometry_.live(), tracked.T_odom_cam, tracked.aligned);
  const auto registered_at = std::chrono::steady_clock::now();
  const std::chrono::duration<double, std::milli> registering = registered_at - tracked_at;
  StageClock::process().add("track", start, tracked_at);
  if (localizer_.statistics().attempts > registered) {
    statistics_.localizer_ms.add(registering.count());
    StageClock::process().add("register", tracked_at, registered_at);
  }
  ++frames_since_keyframe_;
  const auto reason = keyframeReason(tracked, frames_since_keyframe_, medianDepth(frame.depth), config_.keyframes);
  // The depth of a keyframe is shipped as it is when the next one takes over, or when tracking fails.
  if (!reason.empty() || tracked.state == TrackingState::kLost)
    if (auto closed = closeKeyframe(); !closed) return closed.error();
  if (!reason.empty()) {
    odometry_.makeKeyframe(tracked);
  } else {
    odometry_.addToKeyframe(tracked);
  }
  statistics_.odometry_ms.add(
      (std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start) - registering).count());
  if (statistics_.frames == 0) statistics_.first_stamp_ns = frame.stamp_ns;
  statistics_.last_stamp_ns = frame.stamp_ns;
  ++statistics_.frames;
  statistics_.poor_frames += tracked.state == TrackingState::kPoor;
  statistics_.lost_frames += tracked.state == TrackingState::kLost;
  if (tracked.state == TrackingState::kLost && state_ != TrackingState::kLost)
    log_("tracking lost at frame " + std::to_string(statistics_.frames - 1));
  state_ = tracked.state;
  T_odom_cam_ = tracked.T_odom_cam;
  if (!reason.empty()) beginKeyframe(frame, tracked);

  // A lost robot too: it needs the tiles that it finds itself in.
  if (statistics_.frames % config_.interest_every_frames == 0) sendInterest();
  if (statistics_.keyframes == 0 || tracked.state == TrackingState::kLost) return Progress::kFrame;  // stands nowhere
  FrameRecord record;
  record.stamp_ns = frame.stamp_ns;
  record.state = tracked.state;
  record.keyframe = statistics_.keyframes - 1;
  record.T_keyframe_cam = reason.empty() ? tracked.T_keyframe_cam : Pose();
  record_(record);
  if (statistics_.frames % config_.status_every_frames == 0) sendStatus(false);
  return Progress::kFrame;
}

// For a frame that would begin a new chain: it begins one where it was found, or where it is, or, as long as there is
// hope, is LOST. A place that was found ties nothing: a room just like it would tie two rooms into one for ever. That
// is for the core to say, which verifies what it is told like any other match.
void Agent::findBack(const Frame& frame, TrackedFrame& tracked) {
  const FernCode code = encodeFerns(book_, frame.colour, frame.depth);
  const Recovery::Outcome outcome = recovery_.attempt(odometry_.live(), code);
  const bool recognised = outcome != Recovery::Outcome::kFound && localizer_.searches(true) &&
                          localizer_.search(odometry_.live(), code, tracked.T_odom_cam);
  if (recognised) {
    log_("frame " + std::to_string(statistics_.frames) + " is at a place in map " + localizer_.tiles().map());
    return;
  }
  if (outcome == Recovery::Outcome::kLost) {
    tracked.first = false;
    tracked.state = TrackingState::kLost;
  } else if (outcome == Recovery::Outcome::kNewChain) {
    log_("frame " + std::to_string(statistics_.frames) + " begins a new chain");
  } else {
    const Relocalisation& place = recovery_.place();
    log_("frame " + std::to_string(statistics_.frames) + " looks like the place of keyframe " +
         std::to_string(place.sequence) + ": a new chain begins there");
    ++statistics_.relocalised;
    tracked.T_odom_cam = place.T_odom_keyframe * place.T_keyframe_cam;
    odometry_.resume(tracked.T_odom_cam);
    localizer_.recognise(place.sequence, tracked.T_odom_cam);
  }
}

// On a chain that nothing ties to the map, the robot goes on looking for itself in what it holds of it.
void Agent::searchMap(const Frame& frame, const TrackedFrame& tracked) {
  if (!tracked.aligned || !localizer_.searches(false)) return;
  if (localizer_.search(odometry_.live(), encodeFerns(book_, frame.colour, frame.depth), tracked.T_odom_cam))
    log_("frame " + std::to_string(statistics_.frames) + " is at a place in map " + localizer_.tiles().map());
}

void Agent::beginKeyframe(const Frame& frame, const TrackedFrame& tracked) {
  Keyframe keyframe;
  keyframe.id = {config_.robot, session_, statistics_.keyframes};
  keyframe.stamp_ns = frame.stamp_ns;
  keyframe.camera = frame.camera;
  keyframe.colour = frame.colour;
  keyframe.fern_code = encodeFerns(book_, frame.colour, frame.depth);
  keyframe.T_odom_cam = tracked.T_odom_cam;
  if (!tracked.first) {
    keyframe.linked = true;
    keyframe.linked_to = statistics_.keyframes - 1;
    keyframe.T_link_this = tracked.T_keyframe_cam;
    keyframe.information = tracked.alignment.information;  // weak where a direction is not determined
    keyframe.inlier_ratio = tracked.alignment.inlier_ratio;
  }
  statistics_.chains += !keyframe.linked;
  localizer_.keyframeMade(keyframe.id.sequence, keyframe.linked ? MapId() : mapIdOf(keyframe.id));
  keyframe.believed = localizer_.believed();
  recovery_.reset();
  recovery_.remember(keyframe.id.sequence, keyframe.T_odom_cam, keyframe.fern_code, odometry_.live());
  takeFarDepth(frame.depth, config_.odometry.depth_max_m, far_depth_);
  open_ = std::move(keyframe);
  ++statistics_.keyframes;
  frames_since_keyframe_ = 0;
}

Result<void> Agent::closeKeyframe() {
  if (!open_) return {};
  const StageSpan span("encode");
  const SuperKeyframe& depth = odometry_.keyframeDepth();
  depth.writeDepth(mean_depth_m_);
  fillFarDepth(far_depth_, mean_depth_m_);
  depth.writeHits(hits_);
  open_->depth = roundDepth(mean_depth_m_, config_.depth_rounding);
  open_->depth_hits = fewestOfBlocks(hits_, kHitBlock);
  const Keyframe keyframe = std::move(*open_);
  open_.reset();
  if (StageClock::process().traces())
    StageClock::process().note("keyframe", Json{{"keyframe", toString(keyframe.id)}}.dump());
  return sender_.add(keyframe);
}

// A hello may be lost with a core or a link that ended; a robot that is not heard of may be taken for one that ended.
void Agent::keepInTouch(std::chrono::steady_clock::time_point now) {
  const bool peer = link_.peers() > 0;
  if (peer && (!had_peer_ || !welcome_) && now - last_hello_ >= kHelloPeriod) {
    if (!hello()) return;  // again after the next period
  }
  had_peer_ = peer;
  if (now - last_status_ >= kStatusPeriod) sendStatus(finished_);
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
