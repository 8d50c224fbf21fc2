#include "edge_agent/map_cache/tile_store.h"

#include <unistd.h>

#include <algorithm>

#include "protocol/codec/codec.h"
#include "protocol/types/fnv1a.h"
#include "protocol/types/whole_file.h"

namespace comap {
namespace {

constexpr int64_t kApplicationId = 0x434d544c;  // "CMTL"
constexpr int64_t kVersion = 1;
constexpr uint64_t kBytesBeside = 2600;  // a row's share of the file besides its tile: half a page
constexpr double kRoomAfterwards = 0.9;  // of the quota, when something had to go
constexpr double kFileToRows = 0.95;     // the rest is the tables' own

constexpr const char* kTables = R"sql(
CREATE TABLE map(name TEXT PRIMARY KEY, used INTEGER NOT NULL) WITHOUT ROWID;
CREATE TABLE tile(
  map TEXT NOT NULL, x INTEGER NOT NULL, y INTEGER NOT NULL, z INTEGER NOT NULL,
  revision INTEGER NOT NULL, checksum INTEGER NOT NULL, content BLOB NOT NULL,
  UNIQUE(map, x, y, z));
)sql";

// So that a flipped bit is not taken for a surface.
int64_t checksumOf(const TileKey& key, uint64_t revision, std::span<const uint8_t> content) {
  Fnv1a hash;
  for (const int32_t at : {key.x, key.y, key.z}) hash.add(static_cast<uint32_t>(at));
  hash.add(revision);
  hash.addAll(content);
  return static_cast<int64_t>(hash.value());
}

double distance_m(const TileKey& key, const Eigen::Vector3d& position_m) {
  const Eigen::Vector3d centre =
      (Eigen::Vector3d(key.x, key.y, key.z) + Eigen::Vector3d::Constant(0.5)) * double{kTileEdge_m};
  return (centre - position_m).norm();
}

Error damaged(const std::string& path, const std::string& what) { return {ErrorCode::kBadData, path + ": " + what}; }

}  // namespace

Result<TileStore> TileStore::open(const std::string& path, uint64_t quota_bytes) {
  if (auto regular = checkRegular(path); !regular) return regular.error();
  auto database = Database::open(path, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
  if (!database) return database.error();
  TileStore store(std::move(*database), quota_bytes);
  if (auto prepared = store.prepare(); !prepared) return prepared.error();
  if (auto counted = store.count(); !counted) return counted.error();
  return store;
}

Result<void> TileStore::prepare() {
  // Looked at before anything of it is changed: it may be somebody else's.
  if (auto set = database_.execute("PRAGMA busy_timeout = 500"); !set) return set.error();
  const auto application = database_.integer("PRAGMA application_id");
  if (!application) return application.error();
  const auto version = database_.integer("PRAGMA user_version");
  if (!version) return version.error();
  const auto tables = database_.integer("SELECT count(*) FROM sqlite_master");
  if (!tables) return tables.error();
  const bool fresh = *application == 0 && *version == 0 && *tables == 0;
  if (!fresh && *application != kApplicationId)
    return Error{ErrorCode::kProblem, database_.path() + ": is a database of something else than a robot's tiles"};
  if (!fresh && *version != kVersion)
    return damaged(database_.path(),
                   "is of version " + std::to_string(*version) + "; " + std::to_string(kVersion) + " is expected");
  for (const char* pragma : {"PRAGMA locking_mode = EXCLUSIVE", "PRAGMA page_size = 4096",
                             "PRAGMA auto_vacuum = INCREMENTAL", "PRAGMA journal_mode = WAL",
                             // Killed processes lose nothing; whoever fears for the power has the core.
                             "PRAGMA synchronous = OFF", "PRAGMA journal_size_limit = 4000000"})
    if (auto set = database_.execute(pragma); !set) return set.error();
  if (fresh) {
    auto made = Transaction::begin(database_);
    if (!made) return made.error();
    const std::string sql = kTables + ("PRAGMA application_id = " + std::to_string(kApplicationId)) +
                            "; PRAGMA user_version = " + std::to_string(kVersion) + ";";
    if (auto done = database_.execute(sql.c_str()); !done) return done.error();
    return made->commit();
  }
  return {};
}

Result<void> TileStore::count() {
  const auto content = database_.integer("SELECT coalesce(sum(length(content)), 0) FROM tile");
  if (!content) return content.error();
  const auto rows = database_.integer("SELECT count(*) FROM tile");
  if (!rows) return rows.error();
  bytes_ = static_cast<uint64_t>(*content) + static_cast<uint64_t>(*rows) * kBytesBeside;
  return {};
}

Result<std::map<TileKey, uint64_t>> TileStore::revisions(const MapId& map) {
  auto used = database_.query("INSERT OR REPLACE INTO map SELECT ?, coalesce(max(used), 0) + 1 FROM map");
  if (!used) return used.error();
  if (auto done = used->bind(map).run(); !done) return done.error();
  auto rows = database_.query("SELECT x, y, z, revision FROM tile WHERE map = ?");
  if (!rows) return rows.error();
  rows->bind(map);
  std::map<TileKey, uint64_t> revisions;
  for (;;) {
    const auto row = rows->step();
    if (!row) return row.error();
    if (!*row) return revisions;
    TileKey key{map, 0, 0, 0};
    key.x = static_cast<int32_t>(rows->integer());
    key.y = static_cast<int32_t>(rows->integer());
    key.z = static_cast<int32_t>(rows->integer());
    if (!revisions.emplace(key, static_cast<uint64_t>(rows->integer())).second)
      return damaged(database_.path(), "two tiles have one place");  // an index that lost its way: which one counts?
  }
}

Result<Tile> TileStore::read(const TileKey& key) {
  auto row =
      database_.query("SELECT revision, checksum, content FROM tile WHERE map = ? AND x = ? AND y = ? AND z = ?");
  if (!row) return row.error();
  row->bind(key.map).bind(int64_t{key.x}).bind(int64_t{key.y}).bind(int64_t{key.z});
  const auto there = row->step();
  if (!there) return there.error();
  if (!*there) return damaged(database_.path(), "a tile is no longer there");
  const auto revision = static_cast<uint64_t>(row->integer());
  const int64_t checksum = row->integer();
  const auto content = row->bytes();
  if (checksum != checksumOf(key, revision, content))
    return damaged(database_.path(), "a tile is not what was written");
  auto tile = decodeTile(content);
  if (!tile) return damaged(database_.path(), tile.error().text);
  if (tile->key != key || tile->revision != revision) return damaged(database_.path(), "a tile is another one");
  return tile;
}

Result<void> TileStore::remove(const TileKey& key) {
  auto size = database_.query("SELECT length(content) FROM tile WHERE map = ? AND x = ? AND y = ? AND z = ?");
  if (!size) return size.error();
  size->bind(key.map).bind(int64_t{key.x}).bind(int64_t{key.y}).bind(int64_t{key.z});
  const auto there = size->step();
  if (!there) return there.error();
  if (!*there) return {};
  const uint64_t bytes = static_cast<uint64_t>(size->integer()) + kBytesBeside;
  auto gone = database_.query("DELETE FROM tile WHERE map = ? AND x = ? AND y = ? AND z = ?");
  if (!gone) return gone.error();
  if (auto done = gone->bind(key.map).bind(int64_t{key.x}).bind(int64_t{key.y}).bind(int64_t{key.z}).run(); !done)
    return done;
  bytes_ -= std::min(bytes_, bytes);
  return {};
}

// Room for `bytes` more.
Result<std::vector<TileKey>> TileStore::makeRoom(const MapId& map, uint64_t bytes, const Eigen::Vector3d& position_m) {
  std::vector<TileKey> gone;
  const double rows_quota = kFileToRows * static_cast<double>(quota_bytes_);
  const auto fits = [&](double share) { return static_cast<double>(bytes_ + bytes) <= share * rows_quota; };
  while (!fits(1)) {
    auto oldest = database_.query(
        "SELECT DISTINCT tile.map FROM tile LEFT JOIN map ON map.name = tile.map WHERE tile.map != ? "
        "ORDER BY coalesce(map.used, 0) LIMIT 1");
    if (!oldest) return oldest.error();
    oldest->bind(map);
    const auto other = oldest->step();
    if (!other) return other.error();
    if (!*other) break;
    const MapId name = oldest->text();
    auto forget = database_.query("DELETE FROM tile WHERE map = ?");
    if (!forget) return forget.error();
    if (auto done = forget->bind(name).run(); !done) return done.error();
    if (auto counted = count(); !counted) return counted.error();
  }
  if (!fits(1)) {
    const auto known = revisions(map);
    if (!known) return known.error();
    std::vector<std::pair<double, TileKey>> by_distance;
    for (const auto& [key, revision] : *known) by_distance.emplace_back(distance_m(key, position_m), key);
    std::sort(by_distance.begin(), by_distance.end());
    for (; !by_distance.empty() && !fits(kRoomAfterwards); by_distance.pop_back()) {
      if (auto removed = remove(by_distance.back().second); !removed) return removed.error();
      gone.push_back(by_distance.back().second);
    }
  }
  return gone;
}

Result<std::vector<TileKey>> TileStore::write(const MapId& map, std::span<const Change> changes,
                                              const Eigen::Vector3d& position_m) {
  const uint64_t bytes_before = bytes_;
  const auto failed = [&](const Error& error) {
    bytes_ = bytes_before;
    return error;
  };
  auto all = Transaction::begin(database_);
  if (!all) return all.error();
  uint64_t bytes = 0;
  for (const Change& change : changes) {
    if (auto removed = remove(change.key); !removed) return failed(removed.error());
    if (!change.encoded.empty()) bytes += change.encoded.size() + kBytesBeside;
  }
  auto gone = makeRoom(map, bytes, position_m);
  if (!gone) return failed(gone.error());
  for (const Change& change : changes) {
    if (change.encoded.empty()) continue;
    const uint64_t size = change.encoded.size() + kBytesBeside;
    if (static_cast<double>(bytes_ + size) > kFileToRows * static_cast<double>(quota_bytes_)) {
      gone->push_back(change.key);  // more at once than fits at all
      continue;
    }
    auto put = database_.query("INSERT INTO tile VALUES(?, ?, ?, ?, ?, ?, ?)");
    if (!put) return failed(put.error());
    put->bind(change.key.map).bind(int64_t{change.key.x}).bind(int64_t{change.key.y}).bind(int64_t{change.key.z});
    put->bind(static_cast<int64_t>(change.revision));
    put->bind(checksumOf(change.key, change.revision, change.encoded)).bind(std::span<const uint8_t>(change.encoded));
    if (auto done = put->run(); !done) return failed(done.error());
    bytes_ += size;
  }
  if (auto done = all->commit(); !done) return failed(done.error());
  if (auto shrunk = database_.execute("PRAGMA incremental_vacuum"); !shrunk) return shrunk.error();
  return gone;
}

void removeTileStore(const std::string& path) {
  for (const char* part : {"", "-wal", "-shm"}) ::unlink((path + part).c_str());
}

Result<TileStore> openTileStore(const std::string& path, uint64_t quota_bytes,
                                const std::function<void(const std::string& line)>& log) {
  auto store = TileStore::open(path, quota_bytes);
  if (store || store.error().code != ErrorCode::kBadData) return store;
  log("tiles of earlier starts are dropped: " + store.error().text);
  removeTileStore(path);
  return TileStore::open(path, quota_bytes);
}

}  // namespace comap
