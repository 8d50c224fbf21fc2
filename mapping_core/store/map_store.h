// The truth on disk: keyframes as they came over the wire, edges, verdicts, merges, poses; and the derived tiles.
// One SQLite file (WAL). A call returns after its transaction is durable.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "mapping_core/graph/edge.h"
#include "protocol/types/keyframe.h"
#include "protocol/types/messages.h"
#include "protocol/types/result.h"
#include "protocol/types/tile.h"

namespace comap {

/// A keyframe's row without its images.
struct StoredKeyframe {
  KeyframeId id;
  int64_t stamp_ns = 0;
  uint32_t arrival = 0;  ///< 0, 1, 2 ... in order of ingest
  MapId map;
  Pose T_map_cam;
  size_t bytes = 0;  ///< of the encoded keyframe
};

/// Thread rule: one thread at a time.
class MapStore {
 public:
  enum class Mode { kCreateOrOpen, kReadOnly };
  /// kUnreachable if the file cannot be opened; kBadData if it is no map store or of another schema version.
  static Result<MapStore> open(const std::string& path, Mode mode);
  MapStore(MapStore&&) noexcept;
  MapStore& operator=(MapStore&&) noexcept;
  ~MapStore();

  /// Idempotent by id: true if it was new. `encoded` is the keyframe message as received.
  Result<bool> addKeyframe(const KeyframeId& id, int64_t stamp_ns, std::span<const uint8_t> encoded);
  Result<std::vector<StoredKeyframe>> keyframes() const;
  Result<std::vector<uint8_t>> encodedKeyframe(const KeyframeId& id) const;

  /// An edge of the same kind between the same keyframes, in this direction, is replaced in its place.
  Result<void> addEdge(const Edge& edge);
  Result<std::vector<Edge>> edges() const;
  Result<void> addVerdict(const MatchVerdict& verdict);
  Result<std::vector<MatchVerdict>> verdicts() const;
  /// A record of the same number is replaced.
  Result<void> addMerge(const MergeRecord& merge);
  Result<std::vector<MergeRecord>> merges() const;

  /// Replaces poses and map names of the given keyframes in one transaction; kWrongUse, and nothing
  /// changes, if one is not in the store.
  Result<void> setPoses(const MapId& map, const std::map<KeyframeId, Pose>& T_map_cam);
  /// Replaces all tiles of all maps in one transaction.
  Result<void> setTiles(std::span<const Tile> tiles);
  /// Tiles of one map, or of all if `map` is empty, sorted by key.
  Result<std::vector<Tile>> tiles(const MapId& map) const;
  /// Number of surfels and tiles per map, without reading the tiles.
  struct MapSize {
    size_t tiles = 0, surfels = 0;
  };
  Result<std::map<MapId, MapSize>> mapSizes() const;

  /// Robot names in order of first arrival: position = contributor bit.
  Result<std::vector<std::string>> robots() const;

  Result<void> setMeta(const std::string& key, const std::string& value);
  Result<std::string> meta(const std::string& key) const;  ///< empty if unset

 private:
  struct State;
  explicit MapStore(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace comap
