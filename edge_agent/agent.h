// The robot's side at work: frames in; keyframes, interest and status out; corrections and tiles in.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "edge_agent/agent_config.h"
#include "edge_agent/capture/frame_source.h"
#include "edge_agent/keyframes/keyframe_selector.h"
#include "edge_agent/map_cache/map_localizer.h"
#include "edge_agent/odometry/recovery.h"
#include "edge_agent/odometry/visual_odometry.h"
#include "edge_agent/uplink/keyframe_sender.h"
#include "mapping_core/ferns/fern_book.h"
#include "protocol/link/link.h"
#include "protocol/telemetry/time_histogram.h"

namespace comap {

/// One tracked frame, told relative to its keyframe so that it moves with it when the graph does.
struct FrameRecord {
  int64_t stamp_ns = 0;
  uint32_t keyframe = 0;  ///< sequence
  Pose T_keyframe_cam;
  TrackingState state = TrackingState::kOk;
};

struct AgentStatistics {
  uint32_t frames = 0, keyframes = 0, damaged_frames = 0, poor_frames = 0, lost_frames = 0;
  uint32_t chains = 0, relocalised = 0;  ///< starts without a link; times a lost robot saw a place that it knew
  uint64_t tiles_received = 0, tile_bytes_received = 0;
  TimeHistogram localizer_ms;                     ///< of the frames that were registered against tiles
  TimeHistogram odometry_ms;                      ///< tracking and keyframe making, without reading and encoding
  int64_t first_stamp_ns = 0, last_stamp_ns = 0;  ///< of the frames tracked
};

/// Its memory does not grow with the number of frames: what is to be kept of them, `record` keeps.
/// Thread rule: one thread.
class Agent {
 public:
  using Log = std::function<void(const std::string& line)>;
  /// Takes each frame in order, except those that stand nowhere: lost, or before the first keyframe.
  using Record = std::function<void(const FrameRecord& frame)>;
  /// `session` must be new at each start of this robot. Of `outbox`, keyframes of earlier sessions are sent too.
  Agent(const AgentConfig& config, uint64_t session, Outbox outbox, FrameSource& source, Link& link, Log log,
        Record record);

  /// Introduces the robot. Call once before anything else; exchange() repeats it until the core answers, and whenever
  /// the core was out of sight.
  Result<void> hello();

  enum class Progress {
    kFrame,    ///< took one frame
    kWaiting,  ///< the outbox is full: the core must catch up first
    kNoFrame,  ///< the camera has none yet
    kEnded,    ///< the source has ended
  };
  /// Takes one frame from the source, unless too many keyframes wait to be sent. Damaged frames are counted, told and
  /// passed over; kUnreachable or kBadData after 10 of them in a row, unless the source is a camera.
  Result<Progress> takeFrame();

  /// Ships the keyframe that still takes in frames. takeFrame() does so when the source ends; call it when no more
  /// frames will be taken for another reason.
  Result<void> closeKeyframe();

  /// Handles messages for up to `timeout` (returns as soon as there are no more), then sends what is due.
  /// kProblem if the core refuses this robot; the text says why.
  Result<void> exchange(std::chrono::milliseconds timeout);

  /// Tells the core where the robot is and which tiles it holds, unless the last such message still weighs on a slow
  /// uplink.
  void sendInterest();
  /// Tells all how the robot does. `finished`: source ended and all keyframes acknowledged.
  void sendStatus(bool finished);

  /// Tiles are kept on disk too. Call before hello().
  void keepTiles(StoredTiles stored) { localizer_.keepTiles(std::move(stored)); }

  bool allAcknowledged() const { return sender_.waitingInAll() == 0; }  ///< of earlier sessions too
  uint32_t mappedBelow() const { return mapped_below_; }  ///< keyframes in the joint map: all before this sequence
  bool allMapped() const { return mapped_below_ >= statistics_.keyframes; }
  uint32_t unacknowledged() const { return static_cast<uint32_t>(sender_.waitingInAll()); }
  uint32_t onlyInMemory() const { return static_cast<uint32_t>(sender_.waitingInMemory()); }  ///< the disk failed
  /// The core holds them, but the disk does not take even that.
  uint32_t deliveredButThere() const { return static_cast<uint32_t>(sender_.deliveredButThere()); }
  void saveToDisk() { sender_.saveToDisk(); }  ///< what is in memory only; call it at the end
  const SenderLosses& losses() const { return sender_.losses(); }
  void countDamaged(uint32_t keyframes) { sender_.countDamaged(keyframes); }      ///< that its outbox had lost before
  const RefusedKeyframes& refusedKeyframes() const { return sender_.refused(); }  ///< counted as unacknowledged too
  uint64_t waitingBytes() const { return sender_.waitingBytes(); }
  /// How long keyframes have waited without the core acknowledging any; 0 if none waits.
  std::chrono::duration<double> stalled() const;
  bool sourceEnded() const { return source_ended_; }
  bool hasPeer() const { return link_.peers() > 0; }
  uint64_t uplinkBytes() const { return sender_.bytesSent(); }
  uint64_t session() const { return session_; }
  const std::optional<Correction>& correction() const { return correction_; }
  const TileCache& tiles() const { return localizer_.tiles(); }
  const MapLocalizer& localizer() const { return localizer_; }
  const Pose& odometryPose() const { return T_odom_cam_; }
  TrackingState tracking() const { return state_; }
  /// Where the robot believes to be after the last frame and message.
  LivePose livePose() const { return localizer_.live(); }
  const AgentStatistics& statistics() const { return statistics_; }
  std::optional<CaptureHealth> captureHealth() const { return source_.health(); }  ///< nothing for a recording

 private:
  Result<std::optional<Frame>> readFrame();
  void findBack(const Frame& frame, TrackedFrame& tracked);
  void beginKeyframe(const Frame& frame, const TrackedFrame& tracked);
  void searchMap(const Frame& frame, const TrackedFrame& tracked);
  Result<void> handle(const Delivery& delivery);
  void noteWaiting(size_t before);
  void keepInTouch(std::chrono::steady_clock::time_point now);

  AgentConfig config_;
  uint64_t session_;
  FrameSource& source_;
  Link& link_;
  Log log_;
  Record record_;
  FernBook book_;
  VisualOdometry odometry_;
  Recovery recovery_;
  std::optional<Keyframe> open_;  // all but its depth, which frames are still averaged into
  KeyframeSender sender_;
  MapLocalizer localizer_;
  std::optional<Correction> correction_;
  AgentStatistics statistics_;
  TrackingState state_ = TrackingState::kOk;
  int frames_since_keyframe_ = 0;
  int damaged_in_a_row_ = 0, backwards_in_a_row_ = 0;
  bool welcome_ = false;  // the core has answered the hello: topics may overtake each other, so nothing goes before
  bool had_peer_ = false;
  bool source_ended_ = false;
  bool finished_ = false;  // as last told
  std::chrono::steady_clock::time_point last_hello_{}, last_status_{}, last_interest_{}, next_interest_{};
  uint32_t durable_below_ = 0;
  uint32_t mapped_below_ = 0;
  std::optional<std::chrono::steady_clock::time_point> waits_since_;  // of keyframes, or since some were acknowledged
  Pose T_odom_cam_;
  Image<float> mean_depth_m_;  // memory kept between keyframes
  Image<uint8_t> hits_;
  DepthImage far_depth_;  // of the open keyframe's own frame
};

}  // namespace comap
