// The map comes back and is used: where the robot stands in the joint map, refined between the core's corrections by
// registering what it sees against the tiles it holds, and found again in them after it was lost.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "edge_agent/map_cache/map_filter.h"
#include "edge_agent/map_cache/map_registration.h"
#include "edge_agent/map_cache/map_search.h"
#include "edge_agent/map_cache/tile_cache.h"
#include "protocol/types/messages.h"

namespace comap {

struct LocalizerOptions {
  bool enabled = true;
  int every_frames = 5;                  ///< that are tracked well, a registration
  int memory_mb = 64;                    ///< of tiles
  int disk_mb = 256;                     ///< of tiles, beside the outbox; 0: none
  double smooth_frames = 5;              ///< time constant of what consumers see
  double jump_m = 0.3, jump_rad = 0.26;  ///< what is not smoothed: the robot is somewhere else
  /// Registrations in a row that agree with each other but not with what is believed, until they are.
  int insist = 3;
  int search_every_frames = 3;     ///< a lost or astray robot looks for itself in the tiles
  int doubts = 3;                  ///< refusals in a row that take a recognised place back
  uint32_t astray_keyframes = 60;  ///< of a new chain, until the old map is given up
  RegistrationOptions registration;
  MapSearchOptions search;
  MapFilterOptions filter;
};

enum class MapState : uint8_t {
  kUnplaced,    ///< the core has not said where the robot is
  kPlaced,      ///< in the map that the core's last correction names
  kAstray,      ///< a new chain has begun: the pose in the map is not known
  kRecognised,  ///< on a new chain, but the place was recognised; the core has not confirmed it yet
};

/// What the robot believes at this moment, for consumers.
struct LivePose {
  MapState state = MapState::kUnplaced;
  /// That the core has named: while astray or recognised, of the new chain by itself. Empty if it has named none yet;
  /// the poses are then in the odometry frame.
  MapId map;
  Pose T_map_cam;                              ///< smooth: without jumps while the robot stays in one place
  Pose T_map_cam_exact;                        ///< the best estimate
  Pose T_map_odom, T_map_odom_exact;           ///< the same, for a frame that goes on from it by odometry
  Matrix6d covariance = Matrix6d::Identity();  ///< of the exact one when placed, T_map_cam_exact exp(xi)
  /// Recognised: where the robot takes itself to be. One robot's views cannot tell a place from its twin; the core
  /// holds more against it, and until it has joined the maps this is no place to act on.
  std::optional<MapPose> hypothesis;
};

struct LocalizerStatistics {
  uint32_t attempts = 0;                    ///< to register
  uint32_t registered = 0;                  ///< accepted, and weighed in
  std::map<std::string, uint32_t> refused;  ///< by reason
  uint32_t searched = 0, recognised = 0, taken_back = 0;
  std::map<std::string, uint32_t> not_found;  ///< searches, by why the view was not believed to show the best place
  double corrected_m_sum = 0, corrected_m_worst = 0, corrected_rad_worst = 0;  ///< how far registrations moved the pose
};

/// Thread rule: one thread.
class MapLocalizer {
 public:
  explicit MapLocalizer(const LocalizerOptions& options);

  /// After each frame was tracked: the camera's pose in the odometry frame; `aligned`: not a prediction. Registers now
  /// and then. `live` is the frame's pyramid.
  void track(const Pyramid& live, const Pose& T_odom_cam, bool aligned);

  /// Whether search() is worth calling: the robot is lost, or its chain is not tied to the map, and there are tiles.
  bool searches(bool lost) const;
  /// Looks for the view in the tiles, now and then, until one seems to be found, then each time. True once that is
  /// confirmed by later views: a hypothesis that the core is told, see believed(). Call before track(); a lost robot
  /// begins a chain with this frame.
  bool search(const Pyramid& live, const FernCode& code, const Pose& T_odom_cam);

  /// Lost, the robot has seen the place of `keyframe` in its own memory, and begins a chain at T_odom_cam, in the same
  /// odometry frame: recognised, if that keyframe's place in the map is known. Call before track().
  void recognise(uint32_t keyframe, const Pose& T_odom_cam);

  /// A keyframe was made. `chain` names the map it would begin, if it is tied to none before it; else empty.
  void keyframeMade(uint32_t sequence, const MapId& chain);

  /// The core's word. `mapped_below`: keyframes that it has mapped, for what the correction is about.
  void correct(const Correction& correction, uint32_t mapped_below);
  bool put(Tile tile, std::span<const uint8_t> encoded = {}) { return cache_.put(std::move(tile), encoded); }
  /// Keeps tiles on disk too.
  void keepTiles(StoredTiles stored) { cache_.keep(std::move(stored)); }

  LivePose live() const;
  /// Where a keyframe made now should say it is, if the core does not know: see Keyframe::believed.
  std::optional<MapPose> believed() const;
  /// What an interest asks for: how far, and where if the core knows less.
  double interestRadius(double radius_m);
  std::optional<MapPose> interestAt() const;

  const TileCache& tiles() const { return cache_; }
  const LocalizerStatistics& statistics() const { return statistics_; }

 private:
  void follow(const Correction& correction, uint32_t keyframe);
  void registerFrame(const Pyramid& live);
  void noteRegistered(const Pose& T_map_before);
  void hold(const Pose& T_map_odom, const Pose& T_odom_cam);
  void insist(const Pyramid& live, const Registration& found);
  void doubt();
  void smooth();
  Odometer since(uint32_t keyframe) const;

  LocalizerOptions options_;
  TileCache cache_;
  MapFilter filter_;
  MapRegistration registration_;
  MapSearch search_;
  LocalizerStatistics statistics_;
  MapState state_ = MapState::kUnplaced;
  std::optional<Correction> own_chain_;  // the core's word about the chain that is not tied to the map held
  std::optional<uint32_t> chain_start_;  // keyframe that began the chain that is not tied to the map held
  uint32_t tied_from_ = 0;               // keyframe that began the chain that was last placed
  MapId chain_;
  Pose T_map_odom_smooth_;
  Pose T_odom_cam_;
  MapId smooth_map_;
  int frames_since_ = 0, frames_unsearched_ = 0;
  uint64_t frames_ = 0, recognised_at_ = 0;
  int doubts_ = 0;
  Pose T_map_odom_insisted_;
  int insisted_ = 0;
  std::deque<std::pair<uint32_t, Odometer>> marks_;  // of the last keyframes
};

}  // namespace comap
