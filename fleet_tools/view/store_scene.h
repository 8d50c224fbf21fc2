// A map store as it is shown: read once, and again when a core has written to it.
#pragma once

#include <chrono>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "fleet_tools/view/scene_json.h"
#include "fleet_tools/view/view_feed.h"
#include "mapping_core/store/map_store.h"

namespace comap {

/// Thread rule: one thread.
class StoreScene {
 public:
  /// Errors as of MapStore::open; reading beside a core that writes is safe. `with_tiles` is false where tiles come
  /// from elsewhere.
  static Result<StoreScene> open(const std::string& path, bool with_tiles);

  /// Reads what has changed and puts it into the feed; true if anything had. After an error it may be asked again, and
  /// reads all that has changed since it last succeeded.
  Result<bool> refresh(ViewFeed& feed);

  const std::vector<RobotView>& robots() const { return robots_; }
  const std::map<MapId, MapView>& maps() const { return maps_; }
  SiteView site() const;
  const MapStore& store() const { return store_; }
  /// All verdicts that the keyframe has part in, in order of judgement.
  std::vector<MatchVerdict> verdictsOf(const KeyframeId& id) const;

 private:
  using Stamp = std::pair<std::filesystem::file_time_type, uintmax_t>;
  StoreScene(std::string path, MapStore store, bool with_tiles)
      : path_(std::move(path)), store_(std::move(store)), with_tiles_(with_tiles) {}
  std::vector<Stamp> stamps() const;
  Result<void> readRecords();
  Result<void> readTiles(ViewFeed& feed);
  Result<void> countVerdicts();

  std::string path_;
  MapStore store_;
  bool with_tiles_;
  std::vector<Stamp> read_at_;
  bool complete_ = false, tiles_complete_ = false;  // as told last; when tiles were read
  std::string version_;
  std::map<MapId, MapStore::MapSize> sizes_;  // of the tiles that were read
  std::vector<RobotView> robots_;
  std::map<MapId, MapView> maps_;
  std::vector<KeyframeView> keyframes_;
  std::vector<Edge> edges_;
  std::vector<MergeRecord> merges_;
  std::vector<MatchVerdict> verdicts_;
  std::multimap<KeyframeId, size_t> verdicts_of_;
  std::map<std::string, size_t> counts_;
};

}  // namespace comap
