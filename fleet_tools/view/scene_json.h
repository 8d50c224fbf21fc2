// What is shown besides tiles, as plain values, and the feed's sections made of them.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "fleet_tools/view/map_frame.h"
#include "mapping_core/graph/edge.h"
#include "protocol/types/messages.h"

namespace comap {

struct SiteView {
  std::string title;        ///< the store's file, or the site
  bool from_store = false;  ///< keyframes have images and exact poses
  bool live = false;        ///< messages of a running core are heard
  bool complete = false;    ///< the store's core has ended in order
  std::string version;      ///< that wrote the store
  std::optional<CoreStatus> core;
  bool core_heard = false;
  int64_t core_gone_ms =
      0;  ///< since 1970: when a core that had been heard was heard no longer; 0: it is, or never was
  bool contributors_known = false;  ///< the order of robots is that of the contributor bits
};

struct RobotView {
  std::string name;
  std::string state = "stored";  ///< "ok", "poor", "lost", "finished", "silent", "stored"
  size_t keyframes = 0;
  size_t frames = 0, outbox = 0;  ///< live only
  MapId map;
  std::optional<Pose> T_map_cam;  ///< where it is, or was last
};

struct MapView {
  MapId id;
  MapFrame frame;
  size_t tiles = 0, surfels = 0, keyframes = 0;
  std::set<std::string> robots;
};

struct KeyframeView {
  KeyframeId id;
  int64_t stamp_ns = 0;
  uint32_t arrival = 0;
  MapId map;
  Pose T_map_cam;
  uint32_t accepted = 0, refused = 0;  ///< verdicts that it has part in
};

/// A robot's way as it was heard, in the frame of `map`.
struct TrailView {
  std::string robot;
  MapId map;
  std::vector<Eigen::Vector3f> points;
};

std::string siteJson(const SiteView& site);
std::string robotsJson(const std::vector<RobotView>& robots);
std::string mapsJson(const std::vector<MapView>& maps);
/// `robots` give the numbers by which keyframes name them.
std::string keyframesJson(const std::vector<KeyframeView>& keyframes, const std::vector<RobotView>& robots);
/// Loops and edges between robots, by the positions of their keyframes.
std::string edgesJson(const std::vector<Edge>& edges, const std::vector<KeyframeView>& keyframes);
std::string trailsJson(const std::vector<TrailView>& trails);
/// `keyframes`: how many there are, the end of the timeline.
std::string mergesJson(const std::vector<MergeRecord>& merges, size_t keyframes);
/// How many of each reason, and the last few of `verdicts`.
std::string verdictsJson(const std::map<std::string, size_t>& counts, const std::vector<MatchVerdict>& verdicts);

}  // namespace comap
