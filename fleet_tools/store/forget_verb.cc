#include <cstdio>
#include <memory>

#include "fleet_tools/command_line/fail.h"
#include "fleet_tools/command_line/verb.h"
#include "fleet_tools/store/record_json.h"
#include "fleet_tools/store/store_change.h"

namespace comap {
namespace {

struct ForgetOptions {
  StoreChange change;
  std::string robot;
};

int run(const ForgetOptions& options) {
  size_t keyframes = 0;
  const auto remove = [&](MapStore& store) -> Result<void> {
    const auto removed = store.removeRobot(options.robot);
    if (!removed) return removed.error();
    keyframes = *removed;
    return {};
  };
  MapChange done;
  const auto judge = [&](MapBuilder& builder) -> Result<void> {
    auto change = builder.recast();
    if (!change) return change.error();
    done = std::move(*change);
    return {};
  };
  auto outcome = changeStore(options.change, remove, judge);
  if (!outcome) return failWith(outcome.error());
  if (options.change.json) {
    nlohmann::json merges = nlohmann::json::array();
    for (const MergeRecord& merge : done.merges) merges.push_back(jsonOf(merge));
    (*outcome)["keyframes_removed"] = keyframes;
    (*outcome)["merges"] = merges;
    printJson(*outcome);
    return 0;
  }
  std::printf("%zu keyframes of robot %s removed; %zu merges judged anew hold\n", keyframes, options.robot.c_str(),
              done.merges.size());
  printMaps(*outcome);
  return 0;
}

}  // namespace

void addForgetVerb(CLI::App& app, int& exit_code) {
  auto* verb = app.add_subcommand("forget", "Take a robot and all that came from it out of a store at rest");
  verb->footer(
      "Its keyframes, edges and verdicts are gone for good. Merges it was part of are judged anew from the verdicts\n"
      "between the others.\n"
      "Example: fleet forget run/map.comap b");
  auto options = std::make_shared<ForgetOptions>();
  verb->add_option("STORE", options->change.store, "Map store that no core is writing")->required();
  verb->add_option("ROBOT", options->robot, "Name of the robot")->required();
  addStoreChangeOptions(*verb, options->change);
  verb->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace comap
