#include <cstdio>
#include <filesystem>
#include <memory>
#include <set>

#include "fleet_tools/command_line/fail.h"
#include "fleet_tools/command_line/text_table.h"
#include "fleet_tools/command_line/verb.h"
#include "fleet_tools/store/record_json.h"
#include "mapping_core/store/map_store.h"
#include "mapping_core/store/schema.h"
#include "mapping_core/store/store_log.h"

namespace comap {
namespace {

struct RobotInfo {
  std::string name;
  size_t keyframes = 0, bytes = 0;
  std::set<uint64_t> sessions;
  std::set<MapId> maps;
};

struct MapInfo {
  std::set<std::string> robots;
  size_t keyframes = 0, tiles = 0, surfels = 0;
};

struct StoreInfo {
  std::string path, version;
  std::string log_end;       ///< what is wrong with the end of its log
  bool complete = false;     ///< the core that wrote it has ended in order: poses and tiles are final
  bool compact_due = false;  ///< not yet written anew without what was forgotten
  uintmax_t bytes_on_disk = 0;
  size_t keyframes = 0, keyframes_without_pose = 0, merges = 0, undone_merges = 0, withdrawn_edges = 0;
  std::vector<RobotInfo> robots;  // in order of arrival
  std::map<MapId, MapInfo> maps;
  std::array<size_t, kEdgeKinds> edges{};
  size_t accepted = 0;
  std::map<std::string, size_t> refused;
};

uintmax_t bytesOnDisk(const std::string& path) {
  uintmax_t sum = 0;
  for (const char* suffix : {"", "-wal"}) {
    std::error_code code;
    const uintmax_t bytes = std::filesystem::file_size(path + suffix, code);
    if (!code) sum += bytes;
  }
  return sum;
}

Result<void> addKeyframes(const MapStore& store, StoreInfo& info) {
  const auto robots = store.robots();
  if (!robots) return robots.error();
  std::map<std::string, size_t> at;
  for (const std::string& name : *robots) {
    at.emplace(name, info.robots.size());
    info.robots.push_back({name, 0, 0, {}, {}});
  }
  const auto keyframes = store.keyframes();
  if (!keyframes) return keyframes.error();
  info.keyframes = keyframes->size();
  for (const StoredKeyframe& keyframe : *keyframes) {
    const auto found = at.find(keyframe.id.robot);
    if (found == at.end()) {
      return Error{ErrorCode::kBadData, info.path + ": keyframe " + toString(keyframe.id) + " is of no known robot"};
    }
    RobotInfo& robot = info.robots[found->second];
    ++robot.keyframes;
    robot.bytes += keyframe.bytes;
    robot.sessions.insert(keyframe.id.session);
    if (keyframe.map.empty()) {
      ++info.keyframes_without_pose;
      continue;
    }
    robot.maps.insert(keyframe.map);
    MapInfo& map = info.maps[keyframe.map];
    map.robots.insert(robot.name);
    ++map.keyframes;
  }
  return {};
}

Result<StoreInfo> gather(const std::string& path) {
  const Result<MapStore> store = MapStore::open(path, MapStore::Mode::kReadOnly);
  if (!store) return store.error();
  const auto moment = store->beginReading();
  if (!moment) return moment.error();
  StoreInfo info;
  info.path = path;
  info.bytes_on_disk = bytesOnDisk(path);
  const LogEnd log_end = lookAtLog(path);
  info.log_end = log_end.damage + log_end.remark;
  const auto version = store->meta("version");
  if (!version) return version.error();
  info.version = *version;
  const auto complete = store->meta("complete");
  if (!complete) return complete.error();
  info.complete = *complete == "yes";
  const auto compact_due = store->compactDue();
  if (!compact_due) return compact_due.error();
  info.compact_due = *compact_due;
  if (const auto added = addKeyframes(*store, info); !added) return added.error();
  const auto sizes = store->mapSizes();
  if (!sizes) return sizes.error();
  for (const auto& [map, size] : *sizes) {
    info.maps[map].tiles = size.tiles;
    info.maps[map].surfels = size.surfels;
  }
  const auto edges = store->edgeCounts();
  if (!edges) return edges.error();
  info.edges = edges->holding;
  info.withdrawn_edges = edges->withdrawn;
  const auto verdicts = store->verdictCounts();
  if (!verdicts) return verdicts.error();
  for (const auto& [reason, count] : *verdicts) (reason == "accepted" ? info.accepted : info.refused[reason]) = count;
  const auto merges = store->merges();
  if (!merges) return merges.error();
  info.merges = merges->size();
  for (const MergeRecord& merge : *merges) info.undone_merges += !merge.undone.empty();
  return info;
}

nlohmann::json jsonOf(const StoreInfo& info) {
  nlohmann::json robots = nlohmann::json::array(), maps = nlohmann::json::array();
  for (const RobotInfo& robot : info.robots) {
    robots.push_back({{"name", robot.name},
                      {"keyframes", robot.keyframes},
                      {"sessions", robot.sessions.size()},
                      {"bytes", robot.bytes},
                      {"maps", robot.maps}});
  }
  for (const auto& [id, map] : info.maps) {
    maps.push_back({{"id", id},
                    {"robots", map.robots},
                    {"keyframes", map.keyframes},
                    {"tiles", map.tiles},
                    {"surfels", map.surfels}});
  }
  nlohmann::json refused = nlohmann::json::object();
  for (const auto& [reason, count] : info.refused) refused[reason] = count;
  return {{"store", info.path},
          {"bytes_on_disk", info.bytes_on_disk},
          {"schema_version", kStoreVersion},
          {"complete", info.complete},
          {"compact_due", info.compact_due},
          {"log_end", info.log_end.empty() ? nlohmann::json() : nlohmann::json(info.log_end)},
          {"version", info.version.empty() ? nlohmann::json() : nlohmann::json(info.version)},
          {"keyframes", info.keyframes},
          {"keyframes_without_pose", info.keyframes_without_pose},
          {"robots", robots},
          {"maps", maps},
          {"edges",
           {{"odometry", info.edges[0]},
            {"loop", info.edges[1]},
            {"inter_robot", info.edges[2]},
            {"covisibility", info.edges[3]}}},
          {"verdicts", {{"accepted", info.accepted}, {"refused", refused}}},
          {"merges", info.merges},
          {"undone_merges", info.undone_merges},
          {"withdrawn_edges", info.withdrawn_edges}};
}

std::string joined(const std::set<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

void print(const StoreInfo& info) {
  std::printf("%s: %s, schema %lld%s\n", printable(info.path).c_str(), humanBytes(double(info.bytes_on_disk)).c_str(),
              static_cast<long long>(kStoreVersion),
              info.version.empty() ? "" : (", written by CoMap " + printable(info.version)).c_str());
  std::printf("%s (%zu without a pose yet), %s\n", counted(info.keyframes, "keyframe").c_str(),
              info.keyframes_without_pose, counted(info.merges, "merge").c_str());
  if (info.undone_merges > 0)
    std::printf("%zu of the merges %s undone; %s withdrawn\n", info.undone_merges,
                info.undone_merges == 1 ? "is" : "are", counted(info.withdrawn_edges, "edge").c_str());
  if (!info.complete)
    std::printf(
        "INCOMPLETE: the core is still writing or was cut off; poses and tiles are not the final ones\n"
        "('fleet finish', or a core that ends in order, completes them)\n");
  if (!info.log_end.empty()) std::printf("%s\n", printable(info.log_end).c_str());
  if (info.compact_due)
    std::printf("what was forgotten is overwritten; 'fleet finish' writes the file anew without it\n");
  std::printf("edges: %zu odometry, %zu loop, %zu inter-robot, %zu covisibility\n\n", info.edges[0], info.edges[1],
              info.edges[2], info.edges[3]);

  TextTable maps({"MAP", "ROBOTS", "KEYFRAMES", "TILES", "SURFELS"});
  for (const auto& [id, map] : info.maps) {
    maps.add({id, joined(map.robots), std::to_string(map.keyframes), std::to_string(map.tiles),
              std::to_string(map.surfels)});
  }
  std::printf("%s\n", maps.empty() ? "no maps yet" : maps.text().c_str());

  TextTable robots({"ROBOT", "KEYFRAMES", "SESSIONS", "RECEIVED", "MAPS"});
  for (const RobotInfo& robot : info.robots) {
    robots.add({robot.name, std::to_string(robot.keyframes), std::to_string(robot.sessions.size()),
                humanBytes(double(robot.bytes)), joined(robot.maps)});
  }
  std::printf("%s\n", robots.empty() ? "no robots yet" : robots.text().c_str());

  TextTable verdicts({"PLACE MATCHES", "COUNT"});
  verdicts.add({"accepted", std::to_string(info.accepted)});
  for (const auto& [reason, count] : info.refused) verdicts.add({"refused: " + reason, std::to_string(count)});
  std::printf("%s", verdicts.text().c_str());
}

int run(const std::string& path, bool json) {
  const Result<StoreInfo> info = gather(path);
  if (!info) return failWithStore(info.error(), path);
  if (json) {
    printJson(jsonOf(*info));
  } else {
    print(*info);
  }
  return 0;
}

}  // namespace

void addInfoVerb(CLI::App& app, int& exit_code) {
  auto* verb = app.add_subcommand("info", "What a map store holds: maps, robots, keyframes, edges, verdicts");
  verb->footer("Example: fleet info run/map.comap");
  auto path = std::make_shared<std::string>();
  auto json = std::make_shared<bool>(false);
  verb->add_option("STORE", *path, "Map store to read")->required();
  verb->add_flag("--json", *json, "Print one JSON document");
  verb->callback([path, json, &exit_code] { exit_code = run(*path, *json); });
}

}  // namespace comap
