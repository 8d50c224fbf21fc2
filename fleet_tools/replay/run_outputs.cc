#include "fleet_tools/replay/run_outputs.h"

#include <cstdio>
#include <set>

#include "edge_agent/agent_config.h"
#include "fleet_tools/export/map_points.h"
#include "fleet_tools/render/robot_order.h"
#include "fleet_tools/replay/run_folder.h"
#include "fleet_tools/replay/run_trajectory.h"
#include "fleet_tools/report/map_pictures.h"
#include "fleet_tools/report/run_page.h"
#include "mapping_core/service/core_config.h"
#include "mapping_core/store/map_store.h"
#include "mapping_core/tiles/tile_builder.h"
#include "protocol/types/fnv1a.h"
#include "protocol/types/whole_file.h"

namespace comap {
namespace {

using Json = nlohmann::json;

struct RunContent {
  std::map<KeyframeId, StoredKeyframe> keyframes;
  std::map<KeyframeId, Edge> odometry_from;
  std::vector<MatchVerdict> verdicts;
  std::vector<MergeRecord> merges;
  std::map<MapId, MapStore::MapSize> sizes;
  std::map<MapId, std::set<std::string>> robots_of;
  std::map<MapId, size_t> keyframes_of;
  std::vector<std::string> robots;  // in order of arrival, as contributor bits are given
};

Result<RunContent> readContent(const MapStore& store) {
  RunContent content;
  auto keyframes = store.keyframes();
  if (!keyframes) return keyframes.error();
  for (const StoredKeyframe& keyframe : *keyframes) {
    content.keyframes[keyframe.id] = keyframe;
    content.robots_of[keyframe.map].insert(keyframe.id.robot);
    ++content.keyframes_of[keyframe.map];
  }
  auto edges = store.edges();
  if (!edges) return edges.error();
  content.odometry_from = odometryToNext(*edges);
  auto verdicts = store.verdicts();
  if (!verdicts) return verdicts.error();
  content.verdicts = std::move(*verdicts);
  auto merges = store.merges();
  if (!merges) return merges.error();
  content.merges = std::move(*merges);
  auto robots = store.robots();
  if (!robots) return robots.error();
  content.robots = std::move(*robots);
  auto sizes = store.mapSizes();
  if (!sizes) return sizes.error();
  content.sizes = std::move(*sizes);
  return content;
}

MapId largestMap(const RunContent& content, const std::string& robot) {
  MapId best;
  size_t most = 0;
  for (const auto& [map, count] : content.keyframes_of)
    if ((robot.empty() || content.robots_of.at(map).contains(robot)) && count > most) {
      most = count;
      best = map;
    }
  return best;
}

MapId mapWithMostSurfels(const RunContent& content) {
  MapId best = largestMap(content, "");
  const auto surfelsOf = [&](const MapId& map) {
    const auto size = content.sizes.find(map);
    return size == content.sizes.end() ? uint64_t{0} : uint64_t{size->second.surfels};
  };
  for (const auto& [map, count] : content.keyframes_of)
    if (surfelsOf(map) > surfelsOf(best)) best = map;
  return best;
}

Json robotJson(const AgentReport& report, const RunContent& content, const MapId& map) {
  size_t held = 0;
  for (const auto& [id, keyframe] : content.keyframes) held += id.robot == report.robot && id.session == report.session;
  return {
      {"frames", report.frames},
      {"keyframes", report.keyframes},
      {"keyframes_lost", report.keyframes - static_cast<int64_t>(held)},
      {"damaged_frames", report.damaged_frames},
      {"uplink_bytes", report.uplink_bytes},
      {"uplink_bytes_per_s", report.duration_s > 0 ? static_cast<double>(report.uplink_bytes) / report.duration_s : 0},
      {"tracking_poor_frames", report.poor_frames},
      {"tracking_lost_frames", report.lost_frames},
      {"most_behind_s", report.most_behind_s},
      {"chains", report.chains},
      {"relocalised", report.relocalised},
      {"odometry_ms",
       {{"median", report.odometry_ms_median}, {"p95", report.odometry_ms_p95}, {"worst", report.odometry_ms_worst}}},
      {"tiles_received", report.tiles_received},
      {"tiles_held", report.tiles_held},
      {"surfels_held", report.surfels_held},
      {"downlink_bytes", report.tile_bytes_received},
      {"localizer",
       {{"registrations", report.registrations},
        {"refused", report.registrations_refused},
        {"corrected_m", {{"mean", report.corrected_m_mean}, {"worst", report.corrected_m_worst}}},
        {"registration_ms", {{"median", report.registration_ms_median}, {"worst", report.registration_ms_worst}}},
        {"recognised", report.recognised},
        {"taken_back", report.taken_back},
        {"tiles_forgotten", report.tiles_forgotten}}},
      {"ate_rmse_m", nullptr},
      {"map", map}};
}

// Sixteen digits.
std::string hex(uint64_t value) {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(value));
  return text;
}

uint64_t hashOf(const std::string& text) {
  Fnv1a hash;
  hash.addAll(text);
  return hash.value();
}

// From the first keyframe of each robot that the core had to its last.
Json timelineJson(const RunContent& content) {
  Json robots = Json::object();
  for (const auto& [id, keyframe] : content.keyframes) {
    Json& span = robots[id.robot];
    if (span.is_null()) span = {{"first", keyframe.arrival}, {"last", keyframe.arrival}};
    span["first"] = std::min(span["first"].get<uint32_t>(), keyframe.arrival);
    span["last"] = std::max(span["last"].get<uint32_t>(), keyframe.arrival);
  }
  return {{"unit", "keyframe"}, {"robots", robots}};
}

Json parametersJson(const ReplayOptions& options) {
  Json parameters = {{"fern_seed", options.fern_seed},
                     {"device", options.device},
                     {"realtime", options.realtime},
                     {"encrypted", !options.keys.empty()}};
  for (const ReplayRobot& robot : options.robots) parameters["source"][robot.name] = robot.source;
  return parameters;
}

Json reportJson(const ReplayOptions& options, const ReplayOutcome& outcome, const RunContent& content,
                const std::map<MapId, uint64_t>& hashes) {
  Json report;
  for (const AgentReport& robot : outcome.robots)
    report["robots"][robot.robot] = robotJson(robot, content, largestMap(content, robot.robot));
  std::vector<std::string> names;
  for (const ReplayRobot& robot : options.robots) names.push_back(robot.name);
  names = orderByName(content.robots, names);
  for (size_t i = 0; i < names.size(); ++i)
    if (report["robots"].contains(names[i])) report["robots"][names[i]]["colour"] = i;
  report["timeline"] = timelineJson(content);
  report["parameters"] = parametersJson(options);
  report["maps"] = Json::array();
  for (const auto& [map, count] : content.keyframes_of) {
    const auto size = content.sizes.find(map);
    report["maps"].push_back({{"id", map},
                              {"robots", content.robots_of.at(map)},
                              {"keyframes", count},
                              {"surfels", size == content.sizes.end() ? 0 : size->second.surfels},
                              {"tiles", size == content.sizes.end() ? 0 : size->second.tiles},
                              {"hash", hashes.contains(map) ? Json(hex(hashes.at(map))) : Json()}});
  }
  report["merges"] = Json::array();
  for (const MergeRecord& merge : content.merges) {
    Json voters = Json::array();
    for (const KeyframeId& voter : merge.voters) voters.push_back(toString(voter));
    report["merges"].push_back({{"number", merge.number},
                                {"kept", merge.kept},
                                {"absorbed", merge.absorbed},
                                {"robots", merge.robots},
                                {"voters", voters},
                                {"keyframes_ingested", merge.keyframes_ingested},
                                {"undone", merge.undone.empty() ? Json() : Json(merge.undone)}});
  }
  Json refused = Json::object();
  size_t accepted = 0;
  for (const MatchVerdict& verdict : content.verdicts) {
    if (verdict.accepted)
      ++accepted;
    else
      refused[verdict.reason] = refused.value(verdict.reason, 0) + 1;
  }
  report["verdicts"] = {{"accepted", accepted}, {"refused", refused}};
  report["core"] = {
      {"keyframe_ms", {{"median", outcome.core.keyframe_ms_median}, {"p95", outcome.core.keyframe_ms_p95}}},
      {"device", outcome.core.device},
      {"peak_rss_mb", outcome.core.peak_rss_mb},
      {"refused_messages", outcome.core.refused_messages}};
  report["joint_ate_rmse_m"] = nullptr;
  report["surface"] = {{"accuracy_mean_m", nullptr}, {"accuracy_median_m", nullptr}, {"completeness_2cm", nullptr}};
  report["wall_s"] = outcome.wall_s;
  report["parameters_hash"] = hex(hashOf(printAgentConfig({}) + printCoreConfig({})));
  report["version"] = COMAP_VERSION;
  return report;
}

std::vector<Surfel> surfelsOf(std::span<const Tile> tiles) {
  std::vector<Surfel> surfels;
  for (const Tile& tile : tiles)
    for (const TileSurfel& packed : tile.surfels) surfels.push_back(dequantise(packed, tile.key));
  return surfels;
}

}  // namespace

Result<Json> writeRunOutputs(const ReplayOptions& options, const ReplayOutcome& outcome) {
  auto store = MapStore::open(storePathOf(options.out), MapStore::Mode::kReadOnly);
  if (!store) return store.error();
  const auto content = readContent(*store);
  if (!content) return content.error();

  for (const AgentReport& robot : outcome.robots) {
    const auto poses =
        composeTrajectory(robot, largestMap(*content, robot.robot), content->keyframes, content->odometry_from);
    if (auto written = writeTrajectory(options.out + "/" + robot.robot + ".trajectory.txt", poses); !written)
      return written.error();
  }

  std::map<MapId, uint64_t> hashes;
  std::vector<Surfel> surfels;
  const MapId largest = mapWithMostSurfels(*content);
  for (const auto& [map, size] : content->sizes) {
    auto tiles = store->tiles(map);
    if (!tiles) return tiles.error();
    hashes[map] = hashTiles(*tiles);
    if (map == largest) surfels = surfelsOf(*tiles);
  }
  if (auto written = writePly(options.out + "/map.ply", pointsOf(surfels)); !written) return written.error();
  const Json report = reportJson(options, outcome, *content, hashes);
  if (auto written = writeWholeFile(options.out + "/report.json", report.dump(2) + "\n"); !written)
    return written.error();

  std::vector<Pose> T_map_cams;
  for (const auto& [id, keyframe] : content->keyframes)
    if (keyframe.map == largest) T_map_cams.push_back(keyframe.T_map_cam);
  const auto names = orderContributors(content->robots, surfels);
  if (!surfels.empty())
    if (auto painted = paintMap(options.out, options.device, names, surfels, T_map_cams); !painted)
      return painted.error();
  if (auto written = writeRunPage(options.out); !written) return written.error();
  return report;
}

}  // namespace comap
