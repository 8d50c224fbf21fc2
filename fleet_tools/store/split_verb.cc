#include <cstdio>
#include <memory>

#include "fleet_tools/command_line/fail.h"
#include "fleet_tools/command_line/text_table.h"
#include "fleet_tools/command_line/verb.h"
#include "fleet_tools/store/record_json.h"
#include "fleet_tools/store/store_change.h"
#include "mapping_core/service/merge_decision.h"

namespace comap {
namespace {

struct SplitOptions {
  StoreChange change;
  uint32_t merge = 0;
  std::string reason = "by hand";
  bool undo = false;
};

std::string wholeNumber(const std::string& text) {
  const bool digits = !text.empty() && text.size() < 10 && text.find_first_not_of("0123456789") == std::string::npos;
  return digits ? "" : "'" + text + "' is no number of a merge; 'fleet merges' tells them";
}

Result<void> refusal(const SplitOptions& options, const MapStore& store) {
  const auto may = options.undo ? checkRejoin(store, options.merge) : checkSplit(store, options.merge, options.reason);
  return may ? Result<void>() : Result<void>(may.error());
}

// All in one transaction, refused or recorded.
Result<MergeDecision> decide(const SplitOptions& options, const CoreConfig& config, MapStore& store) {
  const auto keyframes = store.mappedKeyframes();
  if (!keyframes) return keyframes.error();
  auto transaction = store.begin();
  if (!transaction) return transaction.error();
  const size_t votes = config.service.mapping.vote.needed;
  auto decision = options.undo ? decideRejoin(store, *keyframes, options.merge, votes)
                               : decideSplit(store, *keyframes, options.merge, options.reason, votes);
  if (!decision) return decision;
  if (auto noted = store.setMeta("complete", "no"); !noted) return noted.error();
  if (auto committed = transaction->commit(); !committed) return committed.error();
  return decision;
}

int run(const SplitOptions& options) {
  const auto config = configOf(options.change);
  if (!config) return failWith(config.error());
  if (auto checked = checkDevice(options.change); !checked) return failWith(checked.error());
  auto store = openToChange(options.change.store, [&](const MapStore& read) { return refusal(options, read); });
  if (!store) return failWithStore(store.error(), options.change.store);
  const auto decision = decide(options, *config, *store);
  if (!decision) return failWith({decision.error().code, options.change.store + ": " + decision.error().text});
  nlohmann::json list = nlohmann::json::array();
  for (const MergeRecord& merge : decision->merges) list.push_back(jsonOf(merge));
  if (!options.change.json)
    for (const MergeRecord& merge : decision->merges)
      std::printf("merge %u %s%s\n", merge.number,
                  options.undo ? "holds again" : "is undone: ", options.undo ? "" : printable(merge.undone).c_str());
  return followUp(options.change, *config, *store, {{options.undo ? "rejoined" : "undone", list}});
}

}  // namespace

void addSplitVerb(CLI::App& app, int& exit_code) {
  auto* verb = app.add_subcommand("split", "Undo a merge of a store at rest, or give it again");
  verb->footer(
      "The merge's closures are withdrawn, and every later edge between the two sides; both maps are what they would\n"
      "be without them. The withdrawn edges are kept and do not join the maps again, unless --undo is given.\n"
      "This is recorded at once; then all maps of the store are computed anew, which may be interrupted and done "
      "later\n"
      "('fleet finish', or a core) and takes as long as the end of a run.\n"
      "Example: fleet merges run/map.comap; fleet split run/map.comap 1; fleet split run/map.comap 1 --undo");
  auto options = std::make_shared<SplitOptions>();
  verb->add_option("STORE", options->change.store, "Map store that no core is writing")->required();
  verb->add_option("MERGE", options->merge, "Number of the merge, as 'fleet merges' tells")
      ->required()
      ->check(CLI::Validator(wholeNumber, "NUMBER", "whole number"));
  auto* undo = verb->add_flag("--undo", options->undo, "Undo the split: the merge holds again");
  verb->add_option("--reason", options->reason, "Why, for the record")->capture_default_str()->excludes(undo);
  addStoreChangeOptions(*verb, options->change);
  verb->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace comap
