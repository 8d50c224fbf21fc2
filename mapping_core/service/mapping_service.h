// The core at work: messages in, keyframes mapped one by one, acknowledgements, corrections, tiles and verdicts out.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "mapping_core/ferns/fern_book.h"
#include "mapping_core/ingest/keyframe_ingest.h"
#include "mapping_core/ingest/robot_registry.h"
#include "mapping_core/service/core_load.h"
#include "mapping_core/service/live_tiles.h"
#include "mapping_core/service/map_builder.h"
#include "mapping_core/service/presence_book.h"
#include "mapping_core/service/store_health.h"
#include "mapping_core/service/tile_delivery.h"
#include "protocol/link/link.h"
#include "protocol/telemetry/log.h"
#include "protocol/telemetry/time_histogram.h"

namespace comap {

struct ServiceOptions {
  MapBuilderOptions mapping;
  uint32_t tile_every_keyframes = 3;  ///< a map's tiles are renewed after so many keyframes, and when the core is idle
  float tile_spacing_m = 0.01f;       ///< level of detail that goes to robots
  /// With so many keyframes waiting the next one is mapped in a hurry (Pace), so that the core catches up. 0: never.
  uint32_t hurry_from_waiting = 3;
  /// From this share of the core's time on that arriving keyframes need (CoreLoad) they are fused in half detail, so
  /// that what robots wait for does not wait for bursts. 0: never.
  double half_detail_from_load = 0.5;
  /// Tiles go no faster than their arrival is reported; else by the robots' budgets alone, without looking at a clock.
  bool pace_tiles = true;
};

struct ServiceStatistics {
  TimeHistogram keyframe_ms;                     ///< from taking a keyframe up to its acknowledgement as mapped
  std::map<std::string, uint64_t> uplink_bytes;  ///< keyframes as they arrived, by robot
  uint64_t refused_messages = 0;                 ///< damaged or unexpected
  std::map<std::string, uint64_t> verdicts;      ///< matches that were judged, by reason
  uint64_t merges = 0, merges_undone = 0;
};

/// The service at one moment.
struct ServiceState {
  struct Robot {
    /// Since it was last heard of, or since this core began if only the one before it has; empty if it never was, or
    /// had ended before.
    std::optional<double> silent_s;
    bool served = false;  ///< by this core, which has heard of it
    bool refused = false, finished = false;
  };
  std::map<std::string, Robot> robots;
  std::map<MapId, uint64_t> surfels;  ///< by map
  uint64_t surfel_bytes = 0;          ///< of device memory
  uint32_t keyframes = 0, waiting = 0, unfused = 0, on_probation = 0;
  CoreLoad::Figure load;
  std::string store_failure;  ///< why the store takes no keyframes; empty as long as it does
};

/// Thread rule: one thread.
class MappingService {
 public:
  using Log = std::function<void(LogLevel level, const std::string& line)>;
  MappingService(const ServiceOptions& options, Link& link, MapStore& store, gpu::Device& device, Log log);

  /// Continues what the store holds from an earlier core, if anything: what is durable is acknowledged to robots that
  /// are still running, what is not yet mapped will be, and surfels are fused anew in the next steps. Call it first.
  Result<void> resume();

  /// Handles all messages that wait, then maps one keyframe. With nothing to map, waits up to `timeout` for a message.
  /// True if anything was done. A store that takes no keyframe (full, read-only) is told, what comes is not
  /// acknowledged, and nothing is mapped until it takes again. Errors are of store or device and leave what is
  /// acknowledged safe.
  Result<bool> step(std::chrono::milliseconds timeout);

  /// True if nothing waits to be mapped and nothing was for a while, whatever else robots say.
  bool quiet() const;

  /// Renews the tiles of maps that have changed. Call when the service is quiet.
  Result<void> refreshTiles();

  /// Maps what is waiting, fuses maps anew whose keyframes moved, and stores the tiles in full detail.
  Result<void> finish(const std::function<void(size_t, size_t)>& progress);

  const ServiceStatistics& statistics() const { return statistics_; }
  ServiceState state() const;
  const TileIndex& tiles() const { return delivery_.tiles(); }
  const std::map<std::string, uint64_t>& tileBytes() const { return delivery_.sentBytes(); }  ///< payload, by receiver

 private:
  Result<void> handle(const Delivery& delivery);
  void noteHello(const std::string& robot, const std::string& refusal);
  void noteAlive(const std::string& robot, uint64_t session);
  void goOnWithout(const Status& status);
  Result<void> handleKeyframe(const Delivery& delivery);
  Result<void> handleInterest(const Delivery& delivery);
  Result<Keyframe> read(const KeyframeId& id);
  Pace paceAt(CoreLoad::Clock::time_point now) const;
  Result<void> mapNext();
  bool mayRenew() const;
  void renewNext();
  Result<void> askNext();
  Result<void> announce(const MapChange& change);
  void announceMerges(const MapChange& change);
  Result<void> publishCorrections();
  Result<void> refreshTilesOf(const KeyframeId& anchor);
  void refuse(const Delivery& delivery, const std::string& why);
  void refuseKeyframe(const Delivery& delivery, const std::string& why);
  void send(Topic topic, const std::string& robot, const Result<std::vector<uint8_t>>& encoded);
  void publishStatus();
  void adviseOnLoad();
  void info(const std::string& line) const { log_(LogLevel::kInfo, line); }
  void error(const std::string& line) const { log_(LogLevel::kError, line); }

  struct Latest {
    KeyframeId id;
    Pose T_odom_cam;
  };
  ServiceOptions options_;
  Link& link_;
  MapStore& store_;
  gpu::Device& device_;
  Log log_;
  StoreHealth store_health_;
  PresenceBook presence_;
  KeyframeIngest ingest_;
  RobotRegistry registry_;
  MapBuilder builder_;
  LiveTiles tiles_;
  TileDelivery delivery_;
  std::map<std::string, uint32_t> robot_index_;  // in order of first keyframe
  std::map<std::string, Latest> latest_;         // last mapped keyframe of each robot
  std::map<KeyframeId, uint32_t> unpublished_;   // anchor -> keyframes since its tiles were renewed
  ServiceStatistics statistics_;
  CoreLoad load_;
  uint32_t keyframes_ = 0;
  uint64_t first_revision_ = 0;  // of corrections: above those of earlier cores on this store
  std::chrono::steady_clock::time_point last_mapped_;
  const std::chrono::steady_clock::time_point started_ = std::chrono::steady_clock::now();
};

}  // namespace comap
