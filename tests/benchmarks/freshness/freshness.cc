#include "tests/benchmarks/freshness/freshness.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <limits>

#include "protocol/types/tile_revision.h"

namespace comap {
namespace {

using Json = nlohmann::json;
using Place = std::pair<std::string, std::array<int, 3>>;  // map, tile

double seconds(const Json& event) { return 1e-6 * static_cast<double>(event.at("ts").get<int64_t>()); }

std::vector<const Json*> eventsNamed(const Json& trace, const std::string& name) {
  std::vector<const Json*> events;
  for (const Json& event : trace)
    if (event.at("ph") == "i" && event.at("name") == name) events.push_back(&event);
  return events;
}

std::string robotOf(const std::string& keyframe) { return keyframe.substr(0, keyframe.find('/')); }

struct Held {
  double at_s;
  uint64_t revision;
};

struct Robot {
  std::map<Place, std::vector<Held>> held;
  std::map<std::string, double> in_map_since_s;

  // Null if it never held the tile at this revision or a later one.
  const Held* firstHeld(const Place& tile, uint64_t revision) const {
    const auto its = held.find(tile);
    if (its == held.end()) return nullptr;
    const auto first =
        std::find_if(its->second.begin(), its->second.end(), [&](const Held& one) { return one.revision >= revision; });
    return first == its->second.end() ? nullptr : &*first;
  }
};

Robot robotFrom(const Json& trace) {
  Robot robot;
  for (const Json* event : eventsNamed(trace, "tile held")) {
    const Json& args = event->at("args");
    const auto map = args.at("map").get<std::string>();
    robot.in_map_since_s.emplace(map, seconds(*event));
    robot.held[{map, args.at("tile").get<std::array<int, 3>>()}].push_back(
        {seconds(*event), args.at("revision").get<uint64_t>()});
  }
  return robot;
}

// What a renewal of a map is about: keyframes mapped since the one before.
struct Renewal {
  double at_s;
  std::string map;
  uint64_t revision;
  std::vector<std::array<int, 3>> tiles;
  std::vector<std::string> keyframes;
};

std::vector<Renewal> renewalsOf(const Json& core) {
  std::map<std::string, std::vector<std::string>> mapped;
  std::vector<Renewal> renewals;
  for (const Json& event : core) {
    if (event.at("ph") != "i") continue;
    const Json& args = event.at("args");
    if (event.at("name") == "mapped")
      mapped[args.at("map").get<std::string>()].push_back(args.at("keyframe").get<std::string>());
    if (event.at("name") != "renewed") continue;
    Renewal renewal{seconds(event), args.at("map").get<std::string>(), args.at("revision").get<uint64_t>(), {}, {}};
    renewal.tiles = args.at("tiles").get<std::vector<std::array<int, 3>>>();
    renewal.keyframes = std::exchange(mapped[renewal.map], {});
    renewals.push_back(std::move(renewal));
  }
  return renewals;
}

}  // namespace

Freshness freshnessOf(const Json& core, const std::map<std::string, Json>& robots) {
  std::map<std::string, double> made_s;
  std::map<std::string, Robot> known;
  for (const auto& [name, trace] : robots) {
    known[name] = robotFrom(trace);
    for (const Json* event : eventsNamed(trace, "keyframe"))
      made_s[event->at("args").at("keyframe").get<std::string>()] = seconds(*event);
  }
  Freshness result;
  for (const Renewal& renewal : renewalsOf(core))
    for (const auto& [name, robot] : known) {
      const auto since = robot.in_map_since_s.find(renewal.map);
      if (since == robot.in_map_since_s.end() || since->second > renewal.at_s) continue;
      for (const auto& tile : renewal.tiles) {
        const Held* first = robot.firstHeld({renewal.map, tile}, coarseRevision(renewal.revision));
        const Held* full = robot.firstHeld({renewal.map, tile}, renewal.revision);
        if (first != nullptr) result.since_renewed_s.push_back(first->at_s - renewal.at_s);
        for (const std::string& keyframe : renewal.keyframes) {
          const auto made = made_s.find(keyframe);
          if (robotOf(keyframe) == name || made == made_s.end()) continue;
          if (first == nullptr)
            ++result.never;
          else
            result.latency_s.push_back(first->at_s - made->second);
          if (full != nullptr) result.full_latency_s.push_back(full->at_s - made->second);
        }
      }
    }
  return result;
}

Downlink downlinkOf(const Json& core, const std::string& robot) {
  Downlink result;
  std::deque<std::pair<double, size_t>> window;
  size_t in_window = 0;
  for (const Json* event : eventsNamed(core, "tile sent")) {
    if (event->at("args").at("robot") != robot) continue;
    const size_t bytes = event->at("args").at("bytes").get<size_t>();
    result.bytes += bytes;
    window.emplace_back(seconds(*event), bytes);
    in_window += bytes;
    while (window.back().first - window.front().first >= 1) {
      in_window -= window.front().second;
      window.pop_front();
    }
    result.worst_second = std::max(result.worst_second, in_window);
  }
  return result;
}

Ending endingOf(const Json& core, const Json& robot) {
  Ending ending;
  const auto ends = eventsNamed(robot, "end");
  if (ends.empty()) return ending;
  const Json& args = ends.back()->at("args");
  ending.map = args.at("map").get<std::string>();
  ending.tiles = args.at("tiles").get<size_t>();
  const double end = seconds(*ends.back());
  double begun = -1, changed = std::numeric_limits<double>::infinity();  // when the core had what it then had
  for (const Json* event : eventsNamed(core, "renewed")) {
    if (event->at("args").at("map") != ending.map) continue;
    if (seconds(*event) <= end)
      begun = std::max(begun, seconds(*event));
    else
      changed = std::min(changed, seconds(*event));
  }
  if (begun < 0) return ending;
  ending.rest_s = end - begun;
  // It may tell that only once it has time, when the robot has gone.
  for (const Json* hash : eventsNamed(core, "tiles hash"))
    if (hash->at("args").at("map") == ending.map && seconds(*hash) >= begun && seconds(*hash) < changed)
      ending.same = hash->at("args").at("hash") == args.at("hash");
  return ending;
}

}  // namespace comap
