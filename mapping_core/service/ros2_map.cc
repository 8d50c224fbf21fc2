#include "mapping_core/service/ros2_map.h"

#include "protocol/types/tile_quantisation.h"

namespace comap {
namespace {

constexpr char kTopic[] = "fleet/map";
constexpr char kType[] = "sensor_msgs/msg/PointCloud2";

int64_t now_ns() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
}

}  // namespace

ros2::PointCloud cloudOf(const MapId& map, const std::vector<const Tile*>& tiles) {
  const Eigen::Matrix3f axes = ros2::rosFromCamera().rotation().toRotationMatrix().cast<float>();
  ros2::PointCloud cloud;
  cloud.header = {now_ns(), "map/" + map};
  for (const Tile* tile : tiles)
    for (const TileSurfel& surfel : tile->surfels) {
      const Eigen::Vector3f p = axes * dequantiseDisc(surfel, tile->key).position;
      cloud.points.push_back({p.x(), p.y(), p.z(), surfel.r, surfel.g, surfel.b});
    }
  return cloud;
}

Result<Ros2Map> Ros2Map::start(const ros2::Ros2Options& options, int fleet_domain) {
  auto node = ros2::Ros2Node::start(options, fleet_domain);
  if (!node) return node.error();
  Ros2Map map(std::move(*node), options.map_points_per_s);
  map.node_->publish(kTopic, kType, ros2::Durability::kParts, ros2::serialise(ros2::PointCloud{{now_ns(), "map"}, {}}));
  return map;
}

void Ros2Map::follow(const TileIndex& tiles, std::chrono::steady_clock::time_point now) {
  constexpr std::chrono::seconds kPeriod(1);
  if (now - last_ < kPeriod) return;
  last_ = now;
  const auto readers = node_->readers(kTopic);
  if (readers.ever > readers_) sent_.clear();
  readers_ = readers.ever;
  if (readers.now == 0) return;
  std::erase_if(sent_, [&](const auto& one) { return !tiles.all().contains(one.first); });
  std::map<MapId, std::vector<const Tile*>> changed;
  size_t points = 0;
  auto at = tiles.all().lower_bound(next_);
  for (size_t looked = 0; looked < tiles.all().size(); ++looked, ++at) {
    if (at == tiles.all().end()) at = tiles.all().begin();
    const auto& [key, tile] = *at;
    const auto before = sent_.find(key);
    if (tile.surfels.empty() || (before != sent_.end() && before->second == tile.revision)) continue;
    if (points > 0 && points + tile.surfels.size() > points_) {
      next_ = key;
      break;
    }
    points += tile.surfels.size();
    changed[key.map].push_back(&tile);
  }
  for (const auto& [map, its] : changed)
    if (node_->publish(kTopic, kType, ros2::Durability::kParts, ros2::serialise(cloudOf(map, its))))
      for (const Tile* tile : its) sent_[tile->key] = tile->revision;
}

}  // namespace comap
