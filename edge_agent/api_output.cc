#include "edge_agent/api_output.h"

#include <algorithm>
#include <chrono>

namespace comap {
namespace {

using robot_api::PlainPose;
using robot_api::PoseNews;

PlainPose plain(const Pose& pose) {
  const Eigen::Vector3d& t = pose.translation();
  const Eigen::Quaterniond& q = pose.rotation();
  return {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()};
}

// All but when it was known and how many there were before.
PoseNews poseOf(const Agent& agent) {
  const LivePose live = agent.livePose();
  PoseNews news;
  news.stamp_ns = agent.statistics().last_stamp_ns;
  news.tracking = static_cast<uint8_t>(agent.tracking());
  news.map_state = static_cast<uint8_t>(live.state);
  news.map = live.map;
  news.T_map_cam = plain(live.T_map_cam);
  news.T_map_cam_exact = plain(live.T_map_cam_exact);
  news.T_map_odom = plain(live.T_map_odom);
  news.T_map_odom_exact = plain(live.T_map_odom_exact);
  news.T_odom_cam = plain(agent.odometryPose());
  news.has_covariance = live.state == MapState::kPlaced;
  if (news.has_covariance)
    for (size_t i = 0; i < 36; ++i)
      news.covariance[i] = live.covariance(static_cast<Eigen::Index>(i / 6), static_cast<Eigen::Index>(i % 6));
  return news;
}

bool same(const PoseNews& a, const PoseNews& b) {
  return a.stamp_ns == b.stamp_ns && a.tracking == b.tracking && a.map_state == b.map_state && a.map == b.map &&
         a.T_map_cam == b.T_map_cam && a.T_map_cam_exact == b.T_map_cam_exact && a.T_map_odom == b.T_map_odom &&
         a.T_map_odom_exact == b.T_map_odom_exact && a.T_odom_cam == b.T_odom_cam && a.covariance == b.covariance;
}

std::shared_ptr<const TileSnapshot> snapshotOf(const TileCache& cache, uint64_t number) {
  auto snapshot = std::make_shared<TileSnapshot>();
  snapshot->number = number;
  snapshot->map = cache.map();
  snapshot->tiles.reserve(cache.tiles().size());
  for (const auto& [key, tile] : cache.tiles()) snapshot->tiles.push_back(tile);
  return snapshot;
}

}  // namespace

Result<ApiOutput> ApiOutput::start(const ApiOptions& options, const std::string& robot, uint64_t session) {
  robot_api::Greeting greeting;
  greeting.session = session;
  greeting.robot = robot;
  auto server = ApiServer::start(options, greeting);
  if (!server) return server.error();
  return ApiOutput(std::move(*server));
}

void ApiOutput::follow(const Agent& agent, const Log& log) {
  for (const std::string& line : server_->takeNews()) log(line);
  bool changed = false;
  if (const TileCache& cache = agent.tiles(); !last_.tiles || cache.changes() != tile_changes_) {
    tile_changes_ = cache.changes();
    last_.tiles = snapshotOf(cache, last_.tiles ? last_.tiles->number + 1 : 1);
    changed = true;
  }
  if (agent.statistics().frames > 0) {
    PoseNews news = poseOf(agent);
    if (last_.pose.sequence == 0 || !same(news, last_.pose)) {
      news.sequence = last_.pose.sequence + 1;
      news.known_at_ns =
          std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
              .count();
      last_.pose = std::move(news);
      changed = true;
    }
    last_.pose.snapshot = last_.tiles->number;
  }
  if (changed) server_->publish(last_);
}

}  // namespace comap
