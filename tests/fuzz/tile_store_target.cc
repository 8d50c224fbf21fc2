// The tiles that a robot keeps on its disk: a file with bad pages, or whole ones whose rows hold anything; read as an
// agent reads it, and written to.
#include "edge_agent/map_cache/tile_store.h"
#include "protocol/codec/codec.h"
#include "tests/fuzz/change_rows.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/sample_files.h"

using namespace comap;

namespace {

constexpr uint64_t kQuota = 1 << 20;

void changeBytes(const std::string& path, FuzzedDataProvider& provider) {
  std::string content = fuzz::readFile(path);
  for (int edits = provider.ConsumeIntegralInRange(1, 12); edits > 0; --edits)
    content[provider.ConsumeIntegralInRange<size_t>(0, content.size() - 1)] = provider.ConsumeIntegral<char>();
  if (provider.ConsumeIntegralInRange(0, 9) == 0)
    content.resize(provider.ConsumeIntegralInRange<size_t>(0, content.size()));  // cut off
  std::ofstream(path, std::ios::binary) << content;
}

void readAll(TileStore& store) {
  for (const char* map : {"m", "n"}) {
    const auto revisions = store.revisions(map);
    if (!revisions) continue;
    for (const auto& [key, revision] : *revisions) {
      const auto tile = store.read(key);
      fuzz::require(!tile || (tile->key == key && tile->revision == revision), "a tile is the one that was asked for");
    }
  }
}

}  // namespace

COMAP_FUZZ_TARGET(bytes) {
  static const fuzz::MemoryFolder folder;
  static const std::string whole = fuzz::writeSampleTileStore(folder / "whole.tiles");
  const std::string path = folder / "a.tiles";
  removeTileStore(path);
  std::filesystem::copy_file(whole, path);
  FuzzedDataProvider provider(bytes.data(), bytes.size());
  if (provider.ConsumeBool())
    changeBytes(path, provider);
  else
    fuzz::changeRows(path, provider);
  auto store = openTileStore(path, kQuota, [](const std::string&) {});
  if (!store) return;  // somebody else's, as far as it says
  readAll(*store);
  Tile tile = fuzz::sampleTile("m", 9);
  const std::vector<TileStore::Change> changes(1, {tile.key, tile.revision, *encodeTile(tile)});
  if (!store->write("m", changes, Eigen::Vector3d::Zero())) return;
  const auto again = store->read(tile.key);
  // It may be gone, with a page or for want of room in a file that says it is full; never is it another one.
  fuzz::require(!again || *again == tile, "what is read is what was written");
  readAll(*store);
}
