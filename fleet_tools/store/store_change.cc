#include "fleet_tools/store/store_change.h"

#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

#include "fleet_tools/command_line/text_table.h"
#include "mapping_core/service/core_config.h"
#include "mapping_core/service/map_finish.h"
#include "mapping_core/tiles/tile_builder.h"

namespace comap {
namespace {

void showProgress(size_t done, size_t all) {
  if (isatty(STDERR_FILENO) == 0) return;
  std::fprintf(stderr, "\r\033[K%s", done == all ? "" : fmt::format("fusing: {} of {}", done, all).c_str());
}

nlohmann::json describe(const MapBuilder& builder, const std::vector<Tile>& tiles) {
  std::map<MapId, std::vector<Tile>> by_map;
  for (const Tile& tile : tiles) by_map[tile.key.map].push_back(tile);
  nlohmann::json maps = nlohmann::json::array();
  const ComponentSet& components = builder.components();
  for (const KeyframeId& anchor : components.anchors()) {
    const MapId id = mapIdOf(anchor);
    maps.push_back({{"id", id},
                    {"robots", components.robots(anchor)},
                    {"keyframes", components.members(anchor).size()},
                    {"hash", fmt::format("{:016x}", hashTiles(by_map[id]))}});
  }
  return {{"maps", maps}};
}

}  // namespace

void addStoreChangeOptions(CLI::App& verb, StoreChange& change) {
  verb.add_option("--device", change.device, "Vulkan device: auto, llvmpipe or a number")->capture_default_str();
  verb.add_option("--config", change.config, "The core's YAML file, if the store was made with one");
  verb.add_flag("--json", change.json, "Print one JSON document");
}

Result<nlohmann::json> changeStore(const StoreChange& options, const std::function<Result<void>(MapStore&)>& before,
                                   const std::function<Result<void>(MapBuilder&)>& change) {
  CoreConfig config;
  if (!options.config.empty()) {
    auto read = readCoreConfig(options.config);
    if (!read) return read.error();
    config = std::move(*read);
  }
  auto store = MapStore::open(options.store, MapStore::Mode::kOpen);
  if (!store) return store.error();
  gpu::DeviceOptions device_options;
  device_options.choice = options.device;
  auto device = gpu::Device::create(device_options);
  if (!device) return device.error();
  if (before)
    if (auto done = before(*store); !done) return done.error();
  MapBuilder builder(*device, *store, config.service.mapping);
  if (auto restored = builder.restore(); !restored) return restored.error();
  if (auto changed = change(builder); !changed)
    return Error{changed.error().code, options.store + ": " + changed.error().text};
  if (auto stored = store->setMeta("complete", "no"); !stored) return stored.error();
  const auto tiles = finishMaps(builder, *store, config.service.mapping.fusion.stable_confidence, showProgress);
  if (!tiles) return tiles.error();
  const auto keyframes = store->keyframes();
  if (!keyframes) return keyframes.error();
  const bool all_mapped = std::none_of(keyframes->begin(), keyframes->end(),
                                       [](const StoredKeyframe& keyframe) { return keyframe.map.empty(); });
  if (auto stored = store->setMeta("complete", all_mapped ? "yes" : "no"); !stored) return stored.error();
  return describe(builder, *tiles);
}

void printMaps(const nlohmann::json& outcome) {
  TextTable table({"MAP", "ROBOTS", "KEYFRAMES", "HASH"});
  for (const auto& map : outcome.at("maps")) {
    std::string robots;
    for (const auto& robot : map.at("robots")) robots += (robots.empty() ? "" : ", ") + robot.get<std::string>();
    table.add({map.at("id").get<std::string>(), robots, std::to_string(map.at("keyframes").get<size_t>()),
               map.at("hash").get<std::string>()});
  }
  std::printf("%s", table.empty() ? "no maps are left\n" : table.text().c_str());
}

}  // namespace comap
