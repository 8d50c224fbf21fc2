#include "fleet_tools/store/store_change.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cstdio>
#include <optional>

#include "fleet_tools/command_line/fail.h"
#include "fleet_tools/command_line/progress.h"
#include "fleet_tools/command_line/text_table.h"
#include "fleet_tools/store/record_json.h"
#include "mapping_core/gpu/device_choice.h"
#include "mapping_core/service/map_finish.h"
#include "mapping_core/store/schema.h"
#include "mapping_core/store/store_log.h"
#include "mapping_core/tiles/tile_builder.h"

namespace comap {
namespace {

// A line for each phase.
class PhaseLines {
 public:
  void show(FinishPhase phase, size_t done, size_t all) {
    if (!line_ || phase != phase_)
      line_.emplace(phase == FinishPhase::kMeasuring ? "measuring keyframes against each other" : "fusing keyframes");
    phase_ = phase;
    line_->show(done, all);
  }

 private:
  std::optional<Progress> line_;
  FinishPhase phase_ = FinishPhase::kMeasuring;
};

nlohmann::json describe(const MapBuilder& builder, const std::vector<Tile>& tiles, const MapChange& recast) {
  std::map<MapId, std::vector<Tile>> by_map;
  for (const Tile& tile : tiles) by_map[tile.key.map].push_back(tile);
  nlohmann::json maps = nlohmann::json::array(), merges = nlohmann::json::array();
  const ComponentSet& components = builder.components();
  for (const KeyframeId& anchor : components.anchors()) {
    const MapId id = mapIdOf(anchor);
    maps.push_back({{"id", id},
                    {"robots", components.robots(anchor)},
                    {"keyframes", components.members(anchor).size()},
                    {"hash", fmt::format("{:016x}", hashTiles(by_map[id]))}});
  }
  for (const MergeRecord& merge : recast.merges) merges.push_back(jsonOf(merge));
  return {{"maps", maps}, {"merges", merges}};
}

}  // namespace

void addComputeOptions(CLI::App& verb, StoreChange& change) {
  verb.add_option("--device", change.device, "Vulkan device: auto, llvmpipe or a number of mapping_core --list-devices")
      ->capture_default_str();
  verb.add_option("--config", change.config, "The core's YAML file, if the store was made with one");
  verb.add_flag("--json", change.json, "Print one JSON document");
}

void addStoreChangeOptions(CLI::App& verb, StoreChange& change) {
  addComputeOptions(verb, change);
  verb.add_flag("--later", change.later,
                "Change the records alone: maps follow with the next start of a core, or 'fleet finish'");
}

Result<CoreConfig> configOf(const StoreChange& change) {
  if (const std::string problem = gpu::choiceProblem(change.device); !problem.empty())
    return Error{ErrorCode::kWrongUse, "--device: " + problem};
  return change.config.empty() ? Result<CoreConfig>(CoreConfig()) : readCoreConfig(change.config);
}

Result<void> checkDevice(const StoreChange& change) {
  if (change.later) return {};
  gpu::DeviceOptions options;
  options.choice = change.device;
  const auto device = gpu::Device::create(options);
  return device ? Result<void>() : Result<void>(device.error());
}

Result<MapStore> openToChange(const std::string& path, const std::function<Result<void>(const MapStore&)>& refusal) {
  if (refusal)
    if (const auto read = MapStore::open(path, MapStore::Mode::kReadOnly); read)
      if (const auto may = refusal(*read); !may && may.error().code == ErrorCode::kWrongUse)
        return Error{may.error().code, path + ": " + may.error().text};
  const LogEnd log_end = lookAtLog(path);
  if (const auto version = storeVersionOf(path); version && *version < kStoreVersion && *version >= kFirstStoreVersion)
    std::fprintf(stderr, "fleet: %s: is of schema version %d, of an earlier release, and is brought to %d first\n",
                 printable(path).c_str(), static_cast<int>(*version), static_cast<int>(kStoreVersion));
  auto store = MapStore::open(path, MapStore::Mode::kOpen);
  const std::string text = log_end.damage + log_end.remark;
  if (store && !text.empty()) std::fprintf(stderr, "fleet: %s: %s\n", path.c_str(), text.c_str());
  return store;
}

Result<nlohmann::json> computeMaps(const StoreChange& change, const CoreConfig& config, MapStore& store) {
  gpu::DeviceOptions device_options;
  device_options.choice = change.device;
  auto device = gpu::Device::create(device_options);
  if (!device) return device.error();
  if (auto stored = store.setMeta("complete", "no"); !stored) return stored.error();
  MapBuilder builder(*device, store, config.service.mapping);
  if (auto restored = builder.restore(); !restored) return restored.error();
  MapChange recast;
  if (builder.recastDue()) {
    auto judged = builder.recast();
    if (!judged) return judged.error();
    recast = std::move(*judged);
  }
  PhaseLines lines;
  const auto tiles = finishMaps(builder, store, config.service.mapping.fusion.stable_confidence,
                                [&](FinishPhase phase, size_t done, size_t all) { lines.show(phase, done, all); });
  if (!tiles) return tiles.error();
  const auto keyframes = store.keyframes();
  if (!keyframes) return keyframes.error();
  const bool all_mapped = std::none_of(keyframes->begin(), keyframes->end(),
                                       [](const StoredKeyframe& keyframe) { return keyframe.map.empty(); });
  if (auto stored = store.setMeta("complete", all_mapped ? "yes" : "no"); !stored) return stored.error();
  return describe(builder, *tiles, recast);
}

Result<bool> compactIfDue(const StoreChange& change, MapStore& store) {
  const auto due = store.compactDue();
  if (!due || !*due) return due;
  if (auto compacted = store.compact(); !compacted)
    return Error{compacted.error().code,
                 change.store +
                     ": the records are changed, but the file could not be written anew without what was forgotten "
                     "('fleet finish' tries again): " +
                     compacted.error().text};
  if (!change.json) {
    std::printf("the file is written anew, without what was forgotten\n");
    std::fflush(stdout);
  }
  return true;
}

int followUp(const StoreChange& change, const CoreConfig& config, MapStore& store, nlohmann::json outcome) {
  outcome["computed"] = !change.later;
  if (change.later) {
    if (change.json)
      printJson(outcome);
    else
      std::printf("the maps follow with the next start of a core, or with: fleet finish %s\n",
                  printable(change.store).c_str());
    return 0;
  }
  std::fflush(stdout);  // the decision holds, whatever becomes of the maps
  auto computed = computeMaps(change, config, store);
  if (!computed)
    return failWith(
        {computed.error().code,
         change.store + ": the records are changed, but the maps could not be computed ('fleet finish' tries again): " +
             computed.error().text});
  outcome["maps"] = std::move((*computed)["maps"]);
  outcome["merges"] = std::move((*computed)["merges"]);
  if (change.json) {
    printJson(outcome);
    return 0;
  }
  if (!outcome["merges"].empty())
    std::printf("%s, judged anew, %s\n", counted(outcome["merges"].size(), "merge").c_str(),
                outcome["merges"].size() == 1 ? "holds" : "hold");
  printMaps(outcome);
  return 0;
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
