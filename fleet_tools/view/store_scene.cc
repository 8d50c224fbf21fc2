#include "fleet_tools/view/store_scene.h"

#include <algorithm>

#include "mapping_core/store/store_remedy.h"

namespace comap {
namespace {

namespace fs = std::filesystem;

bool sameSizes(const std::map<MapId, MapStore::MapSize>& a, const std::map<MapId, MapStore::MapSize>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& x, const auto& y) {
    return x.first == y.first && x.second.tiles == y.second.tiles && x.second.surfels == y.second.surfels;
  });
}

}  // namespace

Result<StoreScene> StoreScene::open(const std::string& path, bool with_tiles) {
  Result<MapStore> store = MapStore::open(path, MapStore::Mode::kReadOnly);
  if (!store) return withRemedy(store.error(), path);
  return StoreScene(path, std::move(*store), with_tiles);
}

std::vector<StoreScene::Stamp> StoreScene::stamps() const {
  std::vector<Stamp> stamps;
  for (const char* suffix : {"", "-wal"}) {
    std::error_code none, other;
    Stamp stamp{fs::last_write_time(path_ + suffix, none), fs::file_size(path_ + suffix, other)};
    stamps.push_back(none || other ? Stamp{} : stamp);
  }
  return stamps;
}

Result<bool> StoreScene::refresh(ViewFeed& feed) {
  const auto now = stamps();  // before reading: what comes in between is read next time
  if (now == read_at_) return false;
  if (auto read = readRecords(); !read) return read.error();
  const auto sizes = store_.mapSizes();
  if (!sizes) return sizes.error();
  if (with_tiles_ && (read_at_.empty() || (complete_ && !tiles_complete_) || !sameSizes(*sizes, sizes_))) {
    if (auto read = readTiles(feed); !read) return read.error();
    sizes_ = *sizes;
    tiles_complete_ = complete_;
  }
  read_at_ = now;
  feed.setSection(ViewSection::kRobots, robotsJson(robots_));
  feed.setSection(ViewSection::kKeyframes, keyframesJson(keyframes_, robots_));
  feed.setSection(ViewSection::kEdges, edgesJson(edges_, keyframes_));
  feed.setSection(ViewSection::kMerges, mergesJson(merges_, keyframes_.size()));
  feed.setSection(ViewSection::kVerdicts, verdictsJson(counts_, verdicts_));
  std::vector<MapView> maps;
  for (const auto& [id, map] : maps_) maps.push_back(map);
  feed.setSection(ViewSection::kMaps, mapsJson(maps));
  feed.setSection(ViewSection::kSite, siteJson(site()));
  return true;
}

SiteView StoreScene::site() const {
  SiteView site;
  site.title = fs::path(path_).filename().string();
  site.from_store = true;
  site.complete = complete_;
  site.version = version_;
  site.contributors_known = true;
  return site;
}

Result<void> StoreScene::readRecords() {
  const auto complete = store_.meta("complete"), version = store_.meta("version");
  if (!complete) return complete.error();
  if (!version) return version.error();
  complete_ = *complete == "yes";
  version_ = *version;
  const auto names = store_.robots();
  if (!names) return names.error();
  const auto keyframes = store_.keyframes();
  if (!keyframes) return keyframes.error();
  auto edges = store_.edges();
  if (!edges) return edges.error();
  auto merges = store_.merges();
  if (!merges) return merges.error();
  auto verdicts = store_.verdicts();
  if (!verdicts) return verdicts.error();
  edges_ = std::move(*edges);
  merges_ = std::move(*merges);
  verdicts_ = std::move(*verdicts);

  robots_.clear();
  for (const std::string& name : *names) robots_.push_back({name, "stored", 0, 0, 0, {}, {}});
  std::map<MapId, MapView> maps;
  std::map<MapId, std::vector<Pose>> poses;
  keyframes_.clear();
  for (const StoredKeyframe& keyframe : *keyframes) {
    const auto robot = std::find_if(robots_.begin(), robots_.end(),
                                    [&](const RobotView& one) { return one.name == keyframe.id.robot; });
    if (robot == robots_.end()) continue;  // came after the list of robots was read
    ++robot->keyframes;
    if (keyframe.map.empty()) continue;
    robot->map = keyframe.map;
    robot->T_map_cam = keyframe.T_map_cam;
    keyframes_.push_back({keyframe.id, keyframe.stamp_ns, keyframe.arrival, keyframe.map, keyframe.T_map_cam, 0, 0});
    MapView& map = maps[keyframe.map];
    map.robots.insert(robot->name);
    ++map.keyframes;
    poses[keyframe.map].push_back(keyframe.T_map_cam);
  }
  for (auto& [id, map] : maps) {
    map.id = id;
    const auto before = maps_.find(id);
    if (before != maps_.end() && before->second.tiles > 0) {
      map.frame = before->second.frame;
      map.tiles = before->second.tiles;
      map.surfels = before->second.surfels;
    } else {
      map.frame = mapFrame({}, poses[id]);
    }
  }
  maps_ = std::move(maps);
  return countVerdicts();
}

Result<void> StoreScene::countVerdicts() {
  verdicts_of_.clear();
  std::map<KeyframeId, std::pair<uint32_t, uint32_t>> counts;
  for (size_t i = 0; i < verdicts_.size(); ++i) {
    for (const KeyframeId& id : {verdicts_[i].query, verdicts_[i].candidate}) {
      verdicts_of_.emplace(id, i);
      ++(verdicts_[i].accepted ? counts[id].first : counts[id].second);
    }
  }
  for (KeyframeView& keyframe : keyframes_) std::tie(keyframe.accepted, keyframe.refused) = counts[keyframe.id];
  auto by_reason = store_.verdictCounts();
  if (!by_reason) return by_reason.error();
  counts_ = std::move(*by_reason);
  return {};
}

Result<void> StoreScene::readTiles(ViewFeed& feed) {
  std::map<MapId, std::vector<Pose>> poses;
  for (const KeyframeView& keyframe : keyframes_) poses[keyframe.map].push_back(keyframe.T_map_cam);
  for (const auto& [id, size] : sizes_)
    if (!maps_.contains(id)) feed.dropTiles(id);
  for (auto& [id, map] : maps_) {
    const auto tiles = store_.tiles(id);  // one map at a time: several may not fit into memory together
    if (!tiles) return tiles.error();
    std::set<TileKey> keys;
    std::vector<const Tile*> list;
    map.tiles = map.surfels = 0;
    for (const Tile& tile : *tiles) {
      if (tile.surfels.empty()) continue;
      feed.setTile(tile);
      keys.insert(tile.key);
      list.push_back(&tile);
      ++map.tiles;
      map.surfels += tile.surfels.size();
    }
    feed.dropTiles(id, keys);
    map.frame = mapFrame(list, poses[id]);
  }
  return {};
}

std::vector<MatchVerdict> StoreScene::verdictsOf(const KeyframeId& id) const {
  std::vector<size_t> numbers;
  for (auto [it, end] = verdicts_of_.equal_range(id); it != end; ++it) numbers.push_back(it->second);
  std::sort(numbers.begin(), numbers.end());
  std::vector<MatchVerdict> found;
  for (const size_t number : numbers) found.push_back(verdicts_[number]);
  return found;
}

}  // namespace comap
