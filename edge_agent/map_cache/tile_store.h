// The tiles of earlier starts, on the robot's disk: one SQLite file.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "protocol/storage/database.h"
#include "protocol/types/result.h"
#include "protocol/types/tile.h"

namespace comap {

/// Tiles as they came over the link, of several maps, so that a robot that begins a map of its own after each start
/// finds those of the joint map when its own becomes part of it. It is a memory and no truth: what is not in it comes
/// again from the core, so no write waits until it is on the disk. A process may end at any moment; after the machine
/// has lost its power the file may be damaged, which the next start finds out. Thread rule: one thread.
class TileStore {
 public:
  /// Makes the file if it is not there. `quota_bytes`: the file grows no larger; beside it lies a journal of some MB.
  /// kUnreachable: it cannot be opened or written, or another agent uses it. kBadData: it is damaged, or no database.
  /// kProblem: it is somebody else's.
  static Result<TileStore> open(const std::string& path, uint64_t quota_bytes);

  struct Change {
    TileKey key;
    uint64_t revision = 0;
    std::vector<uint8_t> encoded;  ///< as decodeTile takes it; empty: no longer there
  };
  /// All changes, which are of `map`, or none. Where there is no room, tiles of the map that was used the longest ago
  /// go first, then those of this map that are farthest from `position_m`, metres in it; the latter are returned.
  Result<std::vector<TileKey>> write(const MapId& map, std::span<const Change> changes,
                                     const Eigen::Vector3d& position_m);

  /// What there is of `map`, which counts as used now. kBadData if the file is damaged.
  Result<std::map<TileKey, uint64_t>> revisions(const MapId& map);
  /// kBadData if it is not what was written.
  Result<Tile> read(const TileKey& key);

  uint64_t bytes() const { return bytes_; }  ///< that count against the quota
  const std::string& path() const { return database_.path(); }

 private:
  TileStore(Database database, uint64_t quota_bytes) : database_(std::move(database)), quota_bytes_(quota_bytes) {}
  Result<void> prepare();
  Result<void> count();
  Result<std::vector<TileKey>> makeRoom(const MapId& map, uint64_t bytes, const Eigen::Vector3d& position_m);
  Result<void> remove(const TileKey& key);

  Database database_;
  uint64_t quota_bytes_, bytes_ = 0;
};

/// Deletes the file; no store of it may be open.
void removeTileStore(const std::string& path);

/// As TileStore::open; a file that is damaged is deleted and begun anew. `log` is told why.
Result<TileStore> openTileStore(const std::string& path, uint64_t quota_bytes,
                                const std::function<void(const std::string& line)>& log);

}  // namespace comap
