#include <cstdio>
#include <memory>

#include "fleet_tools/command_line/fail.h"
#include "fleet_tools/command_line/text_table.h"
#include "fleet_tools/command_line/verb.h"
#include "fleet_tools/store/store_change.h"

namespace comap {
namespace {

struct ForgetOptions {
  StoreChange change;
  std::string robot;
};

int run(const ForgetOptions& options) {
  const auto config = configOf(options.change);
  if (!config) return failWith(config.error());
  if (auto checked = checkDevice(options.change); !checked) return failWith(checked.error());
  auto store = openToChange(options.change.store, [&](const MapStore& read) { return read.checkRobot(options.robot); });
  if (!store) return failWithStore(store.error(), options.change.store);
  const auto removed = store->removeRobot(options.robot);
  if (!removed) return failWith({removed.error().code, options.change.store + ": " + removed.error().text});
  if (!options.change.json) {
    std::printf("%s of robot %s removed\n", counted(*removed, "keyframe").c_str(), options.robot.c_str());
    std::fflush(stdout);
  }
  if (options.change.later) {
    if (!options.change.json)
      std::printf(
          "what they held is overwritten; 'fleet finish', or a core when it ends, writes the file anew without them\n");
    return followUp(options.change, *config, *store, {{"keyframes_removed", *removed}, {"compacted", false}});
  }
  const auto compacted = compactIfDue(options.change, *store);
  if (!compacted) return failWith(compacted.error());
  return followUp(options.change, *config, *store, {{"keyframes_removed", *removed}, {"compacted", *compacted}});
}

}  // namespace

void addForgetVerb(CLI::App& app, int& exit_code) {
  auto* verb = app.add_subcommand("forget", "Take a robot and all that came from it out of a store at rest");
  verb->footer(
      "Its keyframes, edges and verdicts are gone for good. Merges it was part of are judged anew from the verdicts\n"
      "between the others. The file is written anew without them, and all its maps are computed anew; both may be\n"
      "interrupted and done later ('fleet finish', or a core when it ends; until then 'fleet doctor' says so).\n"
      "Example: fleet forget run/map.comap b");
  auto options = std::make_shared<ForgetOptions>();
  verb->add_option("STORE", options->change.store, "Map store that no core is writing")->required();
  verb->add_option("ROBOT", options->robot, "Name of the robot")->required();
  addStoreChangeOptions(*verb, options->change);
  verb->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace comap
