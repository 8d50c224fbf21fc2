#include "fleet_tools/view/live_scene.h"

#include <algorithm>

#include "protocol/codec/codec.h"

namespace comap {
namespace {

constexpr std::chrono::milliseconds kBetweenAsking(500);
constexpr std::chrono::seconds kBetweenFrames(2);
constexpr uint32_t kBudget_bytes_per_s = 32u << 20;  // the core sends what is seen to arrive
constexpr size_t kMostTrailPoints = 4000, kMostKeyframes = 20000;

size_t surfelsIn(const std::map<TileKey, Tile>& tiles) {
  size_t sum = 0;
  for (const auto& [key, tile] : tiles) sum += tile.surfels.size();
  return sum;
}

size_t tilesWithSurfels(const std::map<TileKey, Tile>& tiles) {
  return static_cast<size_t>(
      std::count_if(tiles.begin(), tiles.end(), [](const auto& entry) { return !entry.second.surfels.empty(); }));
}

}  // namespace

void LiveScene::lookForCore() {
  const bool there = link_->peers() > 0;
  if (there == core_there_) return;
  core_there_ = there;
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  core_gone_ms_ = there ? 0 : std::chrono::duration_cast<std::chrono::milliseconds>(now).count();
}

void LiveScene::hear(ViewFeed& feed, std::chrono::milliseconds most) {
  lookForCore();
  const auto until = WatchClock::now() + most;
  for (auto now = WatchClock::now(); now < until; now = WatchClock::now()) {
    const auto delivery = link_->receive(std::chrono::milliseconds(0));
    if (!delivery) break;
    if (delivery->topic == Topic::kTile) {
      takeTile(*delivery, feed);
      continue;
    }
    const bool taken = watch_.take(*delivery, now);
    if (!taken || delivery->topic != Topic::kStatus) continue;
    const auto robot = watch_.robots().find(delivery->robot);
    if (robot != watch_.robots().end() && robot->second.has_status) follow(robot->second.status);
  }
  forgetMaps(feed);
  if (WatchClock::now() - asked_ >= kBetweenAsking) {
    asked_ = WatchClock::now();
    askForTiles();
  }
}

void LiveScene::follow(const Status& status) {
  Trail& trail = trails_[status.robot];
  if (trail.session != status.session) trail = {status.session, 0, 0.03, {}, {}};
  const Eigen::Vector3f at = status.T_odom_cam.translation().cast<float>();
  if (trail.odom_points.empty() || (trail.odom_points.back() - at).norm() >= static_cast<float>(trail.step_m))
    trail.odom_points.push_back(at);
  if (trail.odom_points.size() > kMostTrailPoints) {
    std::vector<Eigen::Vector3f> half;
    for (size_t i = 0; i < trail.odom_points.size(); i += 2) half.push_back(trail.odom_points[i]);
    trail.odom_points = std::move(half);
    trail.step_m *= 2;
  }
  if (status.keyframes <= trail.keyframes) return;
  trail.keyframes = status.keyframes;
  if (trail.heard.size() >= kMostKeyframes) return;
  trail.heard.push_back(
      {{status.robot, status.session, status.keyframes - 1}, arrivals_++, status.stamp_ns, status.T_odom_cam});
}

void LiveScene::takeTile(const Delivery& delivery, ViewFeed& feed) {
  auto tile = decodeTile(delivery.payload);
  if (!tile || !watch_.maps().contains(tile->key.map)) return;
  auto& map = tiles_[tile->key.map];
  const auto held = map.find(tile->key);
  if (held != map.end() && held->second.revision >= tile->revision) return;
  tile->places.clear();
  feed.setTile(*tile);
  const TileKey key = tile->key;
  asking_[key.map].took(key, tile->revision);
  map.insert_or_assign(key, std::move(*tile));
}

void LiveScene::forgetMaps(ViewFeed& feed) {
  const std::set<MapId> maps = watch_.maps();
  std::erase_if(tiles_, [&](const auto& entry) {
    if (maps.contains(entry.first)) return false;
    feed.dropTiles(entry.first);
    asking_.erase(entry.first);
    return true;
  });
}

void LiveScene::askForTiles() {
  for (const MapId& map : watch_.maps()) {
    Interest interest;
    interest.robot = name_;
    interest.budget_bytes_per_s = kBudget_bytes_per_s;
    Eigen::Vector3d robot_m = Eigen::Vector3d::Zero();
    for (const auto& [name, robot] : watch_.robots())
      if (const auto pose = robot.T_map_cam(); pose && robot.correction->map == map) robot_m = pose->translation();
    TileAsking::Question question = asking_[map].next(tiles_[map], robot_m);
    interest.radius_m = question.radius_m;
    interest.at = MapPose{map, Pose(Eigen::Quaterniond::Identity(), question.centre_m)};
    interest.held = std::move(question.held);
    // What does not get through is asked again.
    if (const auto encoded = encodeInterest(interest)) (void)link_->publish(Topic::kInterest, name_, *encoded);
  }
}

std::vector<RobotView> LiveScene::robots(const StoreScene* store) const {
  std::vector<RobotView> views;
  if (store != nullptr) views = store->robots();
  const auto now = WatchClock::now();
  for (const auto& [name, robot] : watch_.robots()) {
    auto it = std::find_if(views.begin(), views.end(), [&](const RobotView& one) { return one.name == name; });
    if (it == views.end()) it = views.insert(views.end(), RobotView{name, {}, 0, 0, 0, {}, {}});
    it->state = stateOf(robot, now);
    if (!robot.has_status) continue;
    it->keyframes = std::max<size_t>(it->keyframes, robot.status.keyframes);
    it->frames = robot.status.frames;
    it->outbox = robot.status.outbox;
    if (const auto pose = robot.T_map_cam()) {
      it->map = robot.correction->map;
      it->T_map_cam = pose;
    }
  }
  return views;
}

std::vector<KeyframeView> LiveScene::keyframes() const {
  struct Counts {
    uint32_t accepted = 0, refused = 0;
  };
  std::map<KeyframeId, Counts> judged;
  for (const MatchVerdict& verdict : watch_.verdicts())
    for (const KeyframeId& id : {verdict.query, verdict.candidate})
      ++(verdict.accepted ? judged[id].accepted : judged[id].refused);
  std::vector<KeyframeView> views;
  for (const auto& [name, trail] : trails_) {
    const auto robot = watch_.robots().find(name);
    if (robot == watch_.robots().end() || !robot->second.T_map_cam()) continue;
    const Correction& correction = *robot->second.correction;
    for (const HeardKeyframe& heard : trail.heard) {
      KeyframeView view{
          heard.id, heard.stamp_ns, heard.arrival, correction.map, correction.T_map_odom * heard.T_odom_cam, 0, 0};
      if (const auto found = judged.find(heard.id); found != judged.end()) {
        view.accepted = found->second.accepted;
        view.refused = found->second.refused;
      }
      views.push_back(std::move(view));
    }
  }
  return views;
}

std::vector<MapView> LiveScene::maps(const std::vector<RobotView>& robots, const StoreScene* store) {
  const bool again = WatchClock::now() - framed_ >= kBetweenFrames;
  if (again) framed_ = WatchClock::now();
  std::vector<MapView> views;
  for (const MapId& id : watch_.maps()) {
    MapView view;
    view.id = id;
    const auto& tiles = tiles_[id];
    view.tiles = tilesWithSurfels(tiles);
    view.surfels = surfelsIn(tiles);
    std::vector<Pose> poses;
    for (const RobotView& robot : robots) {
      if (robot.map != id) continue;
      view.robots.insert(robot.name);
      if (robot.T_map_cam) poses.push_back(*robot.T_map_cam);
    }
    if (store != nullptr && store->maps().contains(id)) view.keyframes = store->maps().at(id).keyframes;
    // The view should not turn with every tile: anew when the map has grown by a tenth.
    if (again && (!frames_.contains(id) || view.surfels > framed_surfels_[id] + framed_surfels_[id] / 10)) {
      std::vector<const Tile*> list;
      for (const auto& [key, tile] : tiles) list.push_back(&tile);
      frames_[id] = mapFrame(list, poses);
      framed_surfels_[id] = view.surfels;
    }
    view.frame = frames_.contains(id) ? frames_[id] : mapFrame({}, poses);
    views.push_back(std::move(view));
  }
  return views;
}

void LiveScene::show(ViewFeed& feed, const StoreScene* store) {
  const std::vector<RobotView> robots = this->robots(store);
  std::vector<MapView> maps = this->maps(robots, store);
  feed.setSection(ViewSection::kRobots, robotsJson(robots));

  std::vector<TrailView> trails;
  for (const auto& [name, trail] : trails_) {
    const auto robot = watch_.robots().find(name);
    if (robot == watch_.robots().end() || !robot->second.T_map_cam()) continue;
    const Correction& correction = *robot->second.correction;
    TrailView view{name, correction.map, {}};
    for (const Eigen::Vector3f& point : trail.odom_points)
      view.points.push_back((correction.T_map_odom * point.cast<double>().eval()).cast<float>());
    trails.push_back(std::move(view));
  }
  feed.setSection(ViewSection::kTrails, trailsJson(trails));

  SiteView site;
  if (store != nullptr) site = store->site();
  site.title = "site " + site_;
  site.live = true;
  site.core = watch_.core();
  site.core_heard = core_there_;
  site.core_gone_ms = core_gone_ms_;
  site.contributors_known = store != nullptr;
  if (store == nullptr) {
    std::vector<MergeRecord> merges;
    for (const auto& [number, merge] : watch_.merges()) merges.push_back(merge);
    const auto keyframes = this->keyframes();
    for (MapView& map : maps)
      map.keyframes = static_cast<size_t>(std::count_if(keyframes.begin(), keyframes.end(),
                                                        [&](const KeyframeView& one) { return one.map == map.id; }));
    feed.setSection(ViewSection::kKeyframes, keyframesJson(keyframes, robots));
    feed.setSection(ViewSection::kMerges,
                    mergesJson(merges, std::max<size_t>(keyframes.size(), site.core ? site.core->keyframes : 0)));
    feed.setSection(ViewSection::kVerdicts,
                    verdictsJson(watch_.verdictCounts(), {watch_.verdicts().begin(), watch_.verdicts().end()}));
  }
  feed.setSection(ViewSection::kMaps, mapsJson(maps));
  feed.setSection(ViewSection::kSite, siteJson(site));
}

std::vector<MatchVerdict> LiveScene::verdictsOf(const KeyframeId& id) const {
  std::vector<MatchVerdict> found;
  for (const MatchVerdict& verdict : watch_.verdicts())
    if (verdict.query == id || verdict.candidate == id) found.push_back(verdict);
  return found;
}

}  // namespace comap
