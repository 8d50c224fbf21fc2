#include "edge_agent/agent.h"

#include <nlohmann/json.hpp>

#include "edge_agent/keyframes/depth_rounding.h"
#include "edge_agent/keyframes/far_depth.h"
#include "mapping_core/ferns/fern_encoder.h"
#include "protocol/telemetry/stage_clock.h"

namespace comap {
namespace {

using Json = nlohmann::json;

constexpr int kDamagedInARow = 10, kBackwardsInARow = 5;
constexpr std::chrono::milliseconds kFrameTurn{10};

SenderOptions senderOptions(const AgentConfig& config) {
  SenderOptions options = config.sender;
  options.outbox_quota_bytes = quotaBytes(config.outbox);
  return options;
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

}  // namespace comap
