// How soon what one robot has seen is on another robot, and what that costs: read from the traces of a core and its
// robots, which share one clock.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace comap {

struct Freshness {
  /// From the moment a robot hands a keyframe to its outbox until another robot of the same map holds a tile that was
  /// renewed after that keyframe was mapped; one for each keyframe, tile and other robot.
  std::vector<double> latency_s;
  std::vector<double> full_latency_s;   ///< until it holds it in full: before, it may have a coarse form of it
  std::vector<double> since_renewed_s;  ///< the last part of it: from when the core had the tile; one a tile and robot
  size_t never = 0;  ///< those that the other robot never held: of a map or a tile that went before it was sent
};

/// `core`, `robots`: events of their traces. A robot is in a map from when it first holds a tile of it.
Freshness freshnessOf(const nlohmann::json& core, const std::map<std::string, nlohmann::json>& robots);

struct Downlink {
  size_t bytes = 0;         ///< payload of tiles
  size_t worst_second = 0;  ///< most bytes in any second, wherever it begins
};
Downlink downlinkOf(const nlohmann::json& core, const std::string& robot);

struct Ending {
  std::string map;
  size_t tiles = 0;
  double rest_s = 0;  ///< from the core's last change of the map until the robot's end
  /// Whether the surfels of all tiles held are the core's, to the bit; nothing if the core did not tell what it had.
  std::optional<bool> same;
};
/// Of a robot whose reach is the whole map.
Ending endingOf(const nlohmann::json& core, const nlohmann::json& robot);

}  // namespace comap
