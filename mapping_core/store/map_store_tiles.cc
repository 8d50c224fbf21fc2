// Tiles: derived, replaced as a whole.
#include "mapping_core/store/map_store_state.h"
#include "mapping_core/store/table_rows.h"
#include "mapping_core/store/tile_bytes.h"

namespace comap {

Result<void> MapStore::setTiles(std::span<const Tile> tiles) {
  Database& database = state_->database;
  Result<Transaction> transaction = Transaction::begin(database);
  if (!transaction) return transaction.error();
  if (Result<void> removed = database.execute("DELETE FROM tiles"); !removed) return removed;
  for (const Tile& tile : tiles) {
    if (tile.surfels.size() > kMaxStoredTileSurfels) {
      return Error{ErrorCode::kWrongUse, database.path() + ": a tile of map " + tile.key.map + " has " +
                                             std::to_string(tile.surfels.size()) + " surfels, expected at most " +
                                             std::to_string(kMaxStoredTileSurfels)};
    }
    const std::vector<uint8_t> frame = compressSurfels(tile.surfels);
    Result<Query> query =
        database.query("INSERT INTO tiles (map, x, y, z, revision, surfels, zstd) VALUES (?, ?, ?, ?, ?, ?, ?)");
    if (!query) return query.error();
    query->bind(tile.key.map).bind(int64_t{tile.key.x}).bind(int64_t{tile.key.y}).bind(int64_t{tile.key.z});
    query->bind(static_cast<int64_t>(tile.revision)).bind(static_cast<int64_t>(tile.surfels.size()));
    if (Result<void> ran = query->bind(frame).run(); !ran) return ran;
  }
  return transaction->commit();
}

Result<std::vector<Tile>> MapStore::tiles(const MapId& map) const {
  Result<Query> query = state_->database.query("SELECT map, x, y, z, revision, surfels, zstd, " COMAP_SOUND_OR(
      "number", COMAP_TILE_ROW) " FROM tiles WHERE ?1 = '' OR map = ?1 ORDER BY map, x, y, z");
  if (!query) return query.error();
  query->bind(map);
  std::vector<Tile> result;
  for (;;) {
    const Result<bool> row = query->step();
    if (!row) return row.error();
    if (!*row) return result;
    Tile tile;
    tile.key.map = query->text();
    int64_t at[3];
    for (int64_t& value : at) {
      value = query->integer();
      if (value < INT32_MIN || value > INT32_MAX) {
        return Error{ErrorCode::kBadData, state_->database.path() + ": a tile's coordinate is " +
                                              std::to_string(value) + ", expected a 32-bit integer"};
      }
    }
    tile.key.x = static_cast<int32_t>(at[0]);
    tile.key.y = static_cast<int32_t>(at[1]);
    tile.key.z = static_cast<int32_t>(at[2]);
    tile.revision = static_cast<uint64_t>(query->integer());
    const int64_t count = query->integer();
    Result<std::vector<TileSurfel>> surfels = decompressSurfels(query->bytes(), count);
    if (!surfels) {
      return Error{surfels.error().code, state_->database.path() + ": map " + tile.key.map + " (" +
                                             std::to_string(tile.key.x) + ", " + std::to_string(tile.key.y) + ", " +
                                             std::to_string(tile.key.z) + "): " + surfels.error().text};
    }
    tile.surfels = std::move(*surfels);
    query->checked("tile");
    result.push_back(std::move(tile));
  }
}

Result<std::map<MapId, MapStore::MapSize>> MapStore::mapSizes() const {
  Result<Query> query =
      state_->database.query("SELECT map, count(*), sum(surfels) FROM tiles WHERE surfels > 0 GROUP BY map");
  if (!query) return query.error();
  std::map<MapId, MapSize> result;
  for (;;) {
    const Result<bool> row = query->step();
    if (!row) return row.error();
    if (!*row) return result;
    const MapId map = query->text();
    const auto tiles = static_cast<size_t>(query->integer());
    result[map] = {tiles, static_cast<size_t>(query->integer())};
  }
}

}  // namespace comap
