// The small messages between robots, core and tools.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocol/types/ids.h"
#include "protocol/types/keyframe_link.h"
#include "protocol/types/map_pose.h"
#include "protocol/types/pose.h"
#include "protocol/types/tile.h"

namespace comap {

/// Robot -> core, once per session: who I am and what my codes mean.
struct Hello {
  std::string robot;
  uint64_t session = 0;
  uint64_t fern_book_hash = 0;
  std::string version;
};

/// Core -> robot: every sequence below `next_expected` is durable at the core, and those in `also_held` too.
/// A refused robot gets the reason here and should stop.
struct Acknowledgement {
  std::string robot;
  uint64_t session = 0;
  uint32_t next_expected = 0;
  std::vector<uint32_t> also_held;
  uint32_t mapped_below = 0;  ///< every sequence below is in the map too, but what the core refused
  std::string refusal;        ///< empty = welcome
  /// Why a keyframe that has just come cannot be taken, and the checksum of its message (messageChecksum): the robot
  /// keeps it and sends it again seldom. Empty: none such has come.
  std::string refused = {};
  uint32_t refused_checksum = 0;
};

/// Core -> robot: where the robot's odometry frame stands in the map it belongs to. Always before tiles of it.
struct Correction {
  std::string robot;
  uint64_t session = 0;
  MapId map;
  Pose T_map_odom;
  uint64_t revision = 0;
};

struct HeldTile {
  TileKey key;
  uint64_t revision = 0;
};

/// Robot -> core: where I am and which tiles I hold, so that the core sends what I lack.
struct Interest {
  std::string robot;
  uint64_t session = 0;
  Pose T_odom_cam;
  double radius_m = 0;
  uint32_t budget_bytes_per_s = 0;
  std::vector<HeldTile> held = {};
  /// The map and place that tiles are wanted for, where it is another than the last correction and T_odom_cam tell.
  std::optional<MapPose> at = {};
};

enum class TrackingState : uint8_t { kOk = 0, kPoor = 1, kLost = 2 };

/// A keyframe that the core cannot take, and what it hangs on.
struct RefusedKeyframe {
  uint64_t session = 0;
  uint32_t sequence = 0;
  KeyframeLink link = {};
};

/// Robot -> all, a few times a second. `finished`: the source has ended and every keyframe is acknowledged.
struct Status {
  std::string robot;
  uint64_t session = 0;
  int64_t stamp_ns = 0;
  Pose T_odom_cam;
  TrackingState tracking = TrackingState::kOk;
  uint32_t frames = 0;
  uint32_t keyframes = 0;
  uint32_t outbox = 0;  ///< keyframes not yet acknowledged, those of earlier sessions included
  bool finished = false;
  uint64_t outbox_bytes = 0;
  uint32_t keyframes_thinned = 0, keyframes_dropped = 0;  ///< for want of room in the outbox
  uint32_t keyframes_refused = 0;                         ///< that the core cannot take; they wait in the outbox
  /// Some of those, in turn: the core need not wait for them with what comes behind.
  std::vector<RefusedKeyframe> refused = {};
};

/// Why a place match was accepted or refused. A refusal is data, kept and queryable.
struct MatchVerdict {
  KeyframeId query, candidate;
  bool accepted = false;
  std::string reason;  ///< "accepted", or a stable word such as "inlier_ratio", "degenerate", "round_trip"
  double fern_dissimilarity = 0;
  double inlier_ratio = 0;
  double rms_sigma = 0;
  double degeneracy = 0;          ///< smallest / largest eigenvalue of the normalised normal matrix
  double photometric_median = 0;  ///< grey levels, after gain and bias
  double seen_through = 0;        ///< share of pixels where the live surface lies behind the map's
  double unlike = 0;              ///< share of textured patches that do not look alike
  double features = 0;            ///< share of patches with anything on them that tells places apart
  double round_trip_m = 0, round_trip_rad = 0;
  Pose T_candidate_query;
  Matrix6d information = Matrix6d::Zero();
};

/// Two maps became one. T_kept_absorbed is the estimate at that moment; edges stay, so that a merge can be undone.
struct MergeRecord {
  uint32_t number = 0;
  MapId kept, absorbed;
  Pose T_kept_absorbed;
  std::vector<std::string> robots;  ///< of the joint map, sorted
  std::vector<KeyframeId> voters;   ///< query keyframes of the closures that agreed
  uint32_t keyframes_ingested = 0;  ///< the core's count when it happened
  std::string undone;               ///< why it was taken back; empty = it holds
};

/// Core -> all.
struct CoreStatus {
  uint32_t keyframes = 0;
  uint32_t maps = 0;
  uint32_t queue = 0;
  std::string device;
};

}  // namespace comap
