// Everything a robot's agent can be told, with defaults that work.
#pragma once

#include <string>

#include "edge_agent/api/api_socket.h"
#include "edge_agent/capture/camera_config.h"
#include "edge_agent/keyframes/depth_rounding.h"
#include "edge_agent/keyframes/keyframe_selector.h"
#include "edge_agent/map_cache/map_localizer.h"
#include "edge_agent/odometry/recovery.h"
#include "edge_agent/odometry/visual_odometry.h"
#include "edge_agent/uplink/keyframe_sender.h"
#include "edge_agent/uplink/outbox_place.h"
#include "mapping_core/ferns/fern_book.h"
#include "protocol/link/dds_link.h"
#include "protocol/ros2/ros2_node.h"
#include "protocol/telemetry/telemetry.h"

namespace comap {

struct AgentConfig {
  std::string robot = "robot";
  std::string source;  ///< URI of the frame source
  CameraConfig camera;
  DdsLinkOptions link;
  OdometryOptions odometry;
  RecoveryOptions recovery;
  KeyframeOptions keyframes;
  DepthRounding depth_rounding;
  LocalizerOptions localizer;
  SenderOptions sender;  ///< its outbox_quota_bytes follows from outbox
  OutboxOptions outbox;
  size_t max_waiting_keyframes = 16;             ///< a recording that need not be in time pauses while so many wait
  uint32_t fern_seed = FernBook::kStandardSeed;  ///< the same as the core's
  double interest_radius_m = 10;
  uint32_t downlink_bytes_per_s = 4'000'000;
  uint32_t interest_every_frames = 15;
  uint32_t status_every_frames = 10;
  TelemetryOptions telemetry;
  ros2::Ros2Options ros2;
  ApiOptions api;
};

/// Reads a YAML file; unknown keys, wrong types and values out of range are errors that name file, line and key.
Result<AgentConfig> readAgentConfig(const std::string& path);
/// The configuration as commented YAML that readAgentConfig takes.
std::string printAgentConfig(const AgentConfig& config);

}  // namespace comap
