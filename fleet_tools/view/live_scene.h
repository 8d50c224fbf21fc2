// A running site as it is shown: what an observer hears, and the tiles that it asks the core for.
#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "fleet_tools/view/scene_json.h"
#include "fleet_tools/view/store_scene.h"
#include "fleet_tools/view/tile_asking.h"
#include "fleet_tools/view/view_feed.h"
#include "fleet_tools/watch/site_watch.h"
#include "protocol/link/link.h"

namespace comap {

/// Without a store beside it, keyframes stand about where their robot was when it told of them.
/// Thread rule: one thread.
class LiveScene {
 public:
  /// `name` is the link's; `site` is shown.
  LiveScene(std::unique_ptr<Link> link, std::string name, std::string site)
      : link_(std::move(link)), name_(std::move(name)), site_(std::move(site)) {}

  /// Takes in what has come, for `most` at the longest, and asks for tiles when it is time; tiles go into the feed.
  void hear(ViewFeed& feed, std::chrono::milliseconds most);
  /// Puts all but tiles into the feed. `store`: gives what it holds better: keyframes, matches, the order of robots.
  void show(ViewFeed& feed, const StoreScene* store);

  std::vector<MatchVerdict> verdictsOf(const KeyframeId& id) const;

 private:
  struct HeardKeyframe {
    KeyframeId id;
    uint32_t arrival = 0;
    int64_t stamp_ns = 0;
    Pose T_odom_cam;
  };
  struct Trail {
    uint64_t session = 0;
    uint32_t keyframes = 0;
    double step_m = 0.03;  // between points, doubled when there are too many
    std::vector<Eigen::Vector3f> odom_points;
    std::vector<HeardKeyframe> heard;
  };
  void lookForCore();
  void follow(const Status& status);
  void takeTile(const Delivery& delivery, ViewFeed& feed);
  void askForTiles();
  void forgetMaps(ViewFeed& feed);
  std::vector<RobotView> robots(const StoreScene* store) const;
  std::vector<MapView> maps(const std::vector<RobotView>& robots, const StoreScene* store);
  std::vector<KeyframeView> keyframes() const;

  std::unique_ptr<Link> link_;
  std::string name_, site_;
  bool core_there_ = false;
  int64_t core_gone_ms_ = 0;
  SiteWatch watch_;
  std::map<MapId, std::map<TileKey, Tile>> tiles_;
  std::map<MapId, TileAsking> asking_;
  std::map<std::string, Trail> trails_;
  uint32_t arrivals_ = 0;
  WatchClock::time_point asked_{}, framed_{};
  std::map<MapId, MapFrame> frames_;
  std::map<MapId, size_t> framed_surfels_;
};

}  // namespace comap
