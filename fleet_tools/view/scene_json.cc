#include "fleet_tools/view/scene_json.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "fleet_tools/render/picture_legend.h"
#include "fleet_tools/render/robot_order.h"
#include "fleet_tools/store/record_json.h"

namespace comap {
namespace {

using Json = nlohmann::json;

constexpr size_t kLastVerdicts = 40;

// What a store holds may be any bytes; browsers get valid UTF-8.
std::string text(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

// A tenth of a millimetre, or of a milliradian; digits beyond only take room.
double rounded(double value) { return std::round(value * 1e4) / 1e4; }

Json vector(const Eigen::Vector3d& v) { return {rounded(v.x()), rounded(v.y()), rounded(v.z())}; }

void append(Json& row, const Pose& pose) {
  for (int i = 0; i < 3; ++i) row.push_back(rounded(pose.translation()[i]));
  const Eigen::Quaterniond& q = pose.rotation();
  for (const double value : {q.x(), q.y(), q.z(), q.w()}) row.push_back(rounded(value));
}

Json poseOf(const std::optional<Pose>& pose) {
  Json row = Json::array();
  if (pose) append(row, *pose);
  return row.empty() ? Json() : row;
}

Json document(const char* section) { return {{"section", section}}; }

}  // namespace

std::string siteJson(const SiteView& site) {
  Json json = document("site");
  json["title"] = site.title;
  json["from_store"] = site.from_store;
  json["live"] = site.live;
  json["complete"] = site.complete;
  json["version"] = site.version;
  json["core_heard"] = site.core_heard;
  json["core_gone_ms"] = site.core_gone_ms;
  json["contributors_known"] = site.contributors_known;
  if (site.core)
    json["core"] = {{"keyframes", site.core->keyframes},
                    {"maps", site.core->maps},
                    {"queue", site.core->queue},
                    {"device", site.core->device}};
  return text(json);
}

std::string robotsJson(const std::vector<RobotView>& robots) {
  Json json = document("robots"), list = Json::array();
  std::vector<std::string> names;
  for (const RobotView& robot : robots) names.push_back(robot.name);
  const std::vector<size_t> places = placesByName(names);
  for (size_t i = 0; i < robots.size(); ++i) {
    const Rgb colour = robotColour(places[i]);
    list.push_back({{"name", robots[i].name},
                    {"colour", {colour.r, colour.g, colour.b}},
                    {"state", robots[i].state},
                    {"keyframes", robots[i].keyframes},
                    {"frames", robots[i].frames},
                    {"outbox", robots[i].outbox},
                    {"map", robots[i].map},
                    {"pose", poseOf(robots[i].T_map_cam)}});
  }
  json["robots"] = std::move(list);
  return text(json);
}

std::string mapsJson(const std::vector<MapView>& maps) {
  Json json = document("maps"), list = Json::array();
  for (const MapView& map : maps) {
    list.push_back({{"id", map.id},
                    {"up", vector(map.frame.up)},
                    {"low", rounded(map.frame.low_m)},
                    {"high", rounded(map.frame.high_m)},
                    {"centre", vector(map.frame.centre)},
                    {"radius", rounded(map.frame.radius_m)},
                    {"tiles", map.tiles},
                    {"surfels", map.surfels},
                    {"keyframes", map.keyframes},
                    {"robots", map.robots}});
  }
  json["maps"] = std::move(list);
  return text(json);
}

std::string keyframesJson(const std::vector<KeyframeView>& keyframes, const std::vector<RobotView>& robots) {
  std::map<std::string, size_t> robot_number;
  for (const RobotView& robot : robots) robot_number.emplace(robot.name, robot_number.size());
  std::map<MapId, size_t> map_number;
  std::vector<MapId> maps;
  Json list = Json::array();
  for (const KeyframeView& keyframe : keyframes) {
    const auto robot = robot_number.find(keyframe.id.robot);
    if (robot == robot_number.end()) continue;
    const auto [map, is_new] = map_number.emplace(keyframe.map, maps.size());
    if (is_new) maps.push_back(keyframe.map);
    // Sessions have 64 bits, numbers of a browser 53.
    Json row = {robot->second,
                std::to_string(keyframe.id.session),
                keyframe.id.sequence,
                map->second,
                std::round(static_cast<double>(keyframe.stamp_ns) / 1e6) / 1e3,
                keyframe.arrival,
                keyframe.accepted,
                keyframe.refused};
    append(row, keyframe.T_map_cam);
    list.push_back(std::move(row));
  }
  Json json = document("keyframes");
  json["columns"] = {"robot", "session", "sequence", "map", "stamp_s", "arrival", "accepted", "refused",
                     "x",     "y",       "z",        "qx",  "qy",      "qz",      "qw"};
  json["maps"] = maps;
  json["keyframes"] = std::move(list);
  return text(json);
}

std::string edgesJson(const std::vector<Edge>& edges, const std::vector<KeyframeView>& keyframes) {
  std::map<KeyframeId, size_t> at;
  for (size_t i = 0; i < keyframes.size(); ++i) at.emplace(keyframes[i].id, i);
  Json list = Json::array();
  for (const Edge& edge : edges) {
    if (edge.kind != EdgeKind::kLoop && edge.kind != EdgeKind::kInterRobot) continue;
    const auto from = at.find(edge.from), to = at.find(edge.to);
    if (from == at.end() || to == at.end() || keyframes[from->second].map != keyframes[to->second].map) continue;
    const Pose &a = keyframes[from->second].T_map_cam, &b = keyframes[to->second].T_map_cam;
    Json row = {keyframes[from->second].map, edge.kind == EdgeKind::kLoop ? "loop" : "inter_robot"};
    for (const Pose& pose : {a, b})
      for (int i = 0; i < 3; ++i) row.push_back(rounded(pose.translation()[i]));
    list.push_back(std::move(row));
  }
  Json json = document("edges");
  json["edges"] = std::move(list);
  return text(json);
}

std::string trailsJson(const std::vector<TrailView>& trails) {
  Json json = document("trails"), list = Json::array();
  for (const TrailView& trail : trails) {
    Json points = Json::array();
    for (const Eigen::Vector3f& point : trail.points)
      for (int i = 0; i < 3; ++i) points.push_back(std::round(double{point[i]} * 1e3) / 1e3);
    list.push_back({{"robot", trail.robot}, {"map", trail.map}, {"points", std::move(points)}});
  }
  json["trails"] = std::move(list);
  return text(json);
}

std::string mergesJson(const std::vector<MergeRecord>& merges, size_t keyframes) {
  Json json = document("merges"), list = Json::array();
  for (const MergeRecord& merge : merges) list.push_back(jsonOf(merge));
  json["merges"] = std::move(list);
  json["keyframes"] = keyframes;
  return text(json);
}

std::string verdictsJson(const std::map<std::string, size_t>& counts, const std::vector<MatchVerdict>& verdicts) {
  Json json = document("verdicts"), list = Json::array();
  for (size_t i = verdicts.size() - std::min(kLastVerdicts, verdicts.size()); i < verdicts.size(); ++i)
    list.push_back(jsonOf(verdicts[i]));
  json["counts"] = counts;
  json["latest"] = std::move(list);
  return text(json);
}

}  // namespace comap
