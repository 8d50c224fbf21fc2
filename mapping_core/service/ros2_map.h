// What ROS 2 programs see of the joint map: /fleet/map, clouds of the tiles that have changed.
#pragma once

#include <chrono>
#include <map>
#include <memory>

#include "mapping_core/tiles/tile_index.h"
#include "protocol/ros2/messages.h"
#include "protocol/ros2/ros2_node.h"

namespace comap {

/// Points of tiles with ROS' axes, in the frame map/ID.
ros2::PointCloud cloudOf(const MapId& map, const std::vector<const Tile*>& tiles);

/// A reader puts the clouds together: rviz2 with a long decay time. Who comes late gets all tiles again.
/// Thread rule: one thread.
class Ros2Map {
 public:
  static Result<Ros2Map> start(const ros2::Ros2Options& options, int fleet_domain);

  /// Publishes tiles that have changed since they were last published, at most once a second and so many points as the
  /// options allow; the others follow with the next calls.
  void follow(const TileIndex& tiles, std::chrono::steady_clock::time_point now);

 private:
  Ros2Map(std::unique_ptr<ros2::Ros2Node> node, uint32_t points) : node_(std::move(node)), points_(points) {}
  std::unique_ptr<ros2::Ros2Node> node_;
  uint32_t points_;
  int readers_ = 0;  // that ever were
  TileKey next_;     // where the next call begins, so that all tiles have their turn
  std::chrono::steady_clock::time_point last_{};
  std::map<TileKey, uint64_t> sent_;  // revisions
};

}  // namespace comap
