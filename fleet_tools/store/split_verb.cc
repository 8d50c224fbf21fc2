#include <cstdio>
#include <memory>

#include "fleet_tools/command_line/fail.h"
#include "fleet_tools/command_line/text_table.h"
#include "fleet_tools/command_line/verb.h"
#include "fleet_tools/store/record_json.h"
#include "fleet_tools/store/store_change.h"

namespace comap {
namespace {

struct SplitOptions {
  StoreChange change;
  uint32_t merge = 0;
  std::string reason = "by hand";
  bool undo = false;
};

int run(const SplitOptions& options) {
  MapChange done;
  const auto act = [&](MapBuilder& builder) -> Result<void> {
    auto change = options.undo ? builder.rejoin(options.merge) : builder.split(options.merge, options.reason);
    if (!change) return change.error();
    done = std::move(*change);
    return {};
  };
  auto outcome = changeStore(options.change, {}, act);
  if (!outcome) return failWith(outcome.error());
  const std::vector<MergeRecord>& merges = options.undo ? done.merges : done.undone;
  if (options.change.json) {
    nlohmann::json list = nlohmann::json::array();
    for (const MergeRecord& merge : merges) list.push_back(jsonOf(merge));
    (*outcome)[options.undo ? "rejoined" : "undone"] = list;
    printJson(*outcome);
    return 0;
  }
  for (const MergeRecord& merge : merges)
    std::printf("merge %u %s%s\n", merge.number,
                options.undo ? "holds again" : "is undone: ", options.undo ? "" : printable(merge.undone).c_str());
  printMaps(*outcome);
  return 0;
}

}  // namespace

void addSplitVerb(CLI::App& app, int& exit_code) {
  auto* verb = app.add_subcommand("split", "Undo a merge of a store at rest, or give it again");
  verb->footer(
      "The merge's closures are withdrawn, and every later edge between the two sides; both maps are what they would\n"
      "be without them. The withdrawn edges are kept and do not join the maps again, unless --undo is given.\n"
      "Example: fleet merges run/map.comap; fleet split run/map.comap 1; fleet split run/map.comap 1 --undo");
  auto options = std::make_shared<SplitOptions>();
  verb->add_option("STORE", options->change.store, "Map store that no core is writing")->required();
  verb->add_option("MERGE", options->merge, "Number of the merge, as 'fleet merges' tells")->required();
  auto* undo = verb->add_flag("--undo", options->undo, "Undo the split: the merge holds again");
  verb->add_option("--reason", options->reason, "Why, for the record")->capture_default_str()->excludes(undo);
  addStoreChangeOptions(*verb, options->change);
  verb->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace comap
