#include <cstdio>
#include <memory>

#include "fleet_tools/command_line/fail.h"
#include "fleet_tools/command_line/text_table.h"
#include "fleet_tools/command_line/verb.h"
#include "fleet_tools/store/record_json.h"
#include "fleet_tools/store/store_change.h"
#include "mapping_core/store/schema.h"

namespace comap {
namespace {

int run(const StoreChange& change) {
  const auto config = configOf(change);
  if (!config) return failWith(config.error());
  const auto version = storeVersionOf(change.store);
  auto store = openToChange(change.store);
  if (!store) return failWithStore(store.error(), change.store);
  const auto complete = store->meta("complete");
  if (!complete) return failWith(complete.error());
  const auto compacted = compactIfDue(change, *store);
  if (!compacted) return failWith(compacted.error());
  const bool migrated = version && *version < kStoreVersion;
  nlohmann::json outcome = {{"compacted", *compacted}};
  if (migrated) outcome["migrated_from"] = *version;
  if (*complete != "yes") return followUp(change, *config, *store, std::move(outcome));
  outcome["computed"] = false;
  if (change.json) {
    printJson(outcome);
    return 0;
  }
  const std::string path = printable(change.store);
  if (migrated)
    std::printf("%s: brought from schema version %d to %d\n", path.c_str(), static_cast<int>(*version),
                static_cast<int>(kStoreVersion));
  std::printf("%s: %s, poses and tiles are final\n", path.c_str(),
              *compacted || migrated ? "nothing else to do" : "nothing to do");
  return 0;
}

}  // namespace

void addFinishVerb(CLI::App& app, int& exit_code) {
  auto* verb = app.add_subcommand("finish", "Compute what the maps of a store at rest are still due");
  verb->footer(
      "After 'split', 'forget' or 'recover' with --later or cut off, and after a core that was: poses, surfels and\n"
      "tiles as the records have them; and the file without what was forgotten. Keyframes that were not mapped yet "
      "are\n"
      "left to a core.\n"
      "Example: fleet split run/map.comap 1 --later; fleet finish run/map.comap");
  auto change = std::make_shared<StoreChange>();
  verb->add_option("STORE", change->store, "Map store that no core is writing")->required();
  addComputeOptions(*verb, *change);
  verb->callback([change, &exit_code] { exit_code = run(*change); });
}

}  // namespace comap
