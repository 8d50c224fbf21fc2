#include <cstdio>
#include <memory>
#include <numbers>

#include "fleet_tools/command_line/fail.h"
#include "fleet_tools/command_line/text_table.h"
#include "fleet_tools/command_line/verb.h"
#include "fleet_tools/store/record_json.h"
#include "mapping_core/store/map_store.h"

namespace comap {
namespace {

void print(const std::vector<MergeRecord>& merges) {
  if (merges.empty()) {
    std::printf("no maps were merged\n");
    return;
  }
  TextTable table({"MERGE", "KEPT", "ABSORBED", "ROBOTS", "VOTES", "SHIFT m", "TURN deg", "AT KEYFRAME", "UNDONE"});
  for (const MergeRecord& m : merges) {
    std::string robots;
    for (const std::string& robot : m.robots) robots += (robots.empty() ? "" : ", ") + robot;
    table.add({std::to_string(m.number), m.kept, m.absorbed, robots, std::to_string(m.voters.size()),
               fixed(m.T_kept_absorbed.translation().norm(), 3),
               fixed(m.T_kept_absorbed.angle() * 180 / std::numbers::pi, 1), std::to_string(m.keyframes_ingested),
               m.undone.empty() ? "-" : m.undone});
  }
  std::printf("%s", table.text().c_str());
}

int run(const std::string& path, bool json) {
  const Result<MapStore> store = MapStore::open(path, MapStore::Mode::kReadOnly);
  if (!store) return failWithStore(store.error(), path);
  const auto moment = store->beginReading();
  if (!moment) return failWith(moment.error());
  const Result<std::vector<MergeRecord>> merges = store->merges();
  if (!merges) return failWith(merges.error());
  if (!json) {
    print(*merges);
    return 0;
  }
  nlohmann::json list = nlohmann::json::array();
  for (const MergeRecord& merge : *merges) list.push_back(jsonOf(merge));
  printJson({{"merges", list}});
  return 0;
}

}  // namespace

void addMergesVerb(CLI::App& app, int& exit_code) {
  auto* verb = app.add_subcommand("merges", "Which maps became one, when, by whose votes, and which of it was undone");
  verb->footer("Example: fleet merges run/map.comap");
  auto path = std::make_shared<std::string>();
  auto json = std::make_shared<bool>(false);
  verb->add_option("STORE", *path, "Map store to read")->required();
  verb->add_flag("--json", *json, "Print one JSON document");
  verb->callback([path, json, &exit_code] { exit_code = run(*path, *json); });
}

}  // namespace comap
