#include <algorithm>
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

struct MatchesOptions {
  std::string store, reason, robot;
  bool refused = false, json = false;
};

std::string failedText(const MatchVerdict& verdict) {
  std::string text;
  for (const FailedNumber& number : failedNumbers(verdict)) {
    const bool degeneracy = number.name == std::string("degeneracy");
    text += (text.empty() ? "" : ", ") + std::string(number.name) + " " + fixed(number.value, degeneracy ? 5 : 3);
  }
  return text.empty() ? std::string("-") : text;
}

void printCounts(const std::map<std::string, size_t>& counts) {
  TextTable table({"VERDICT", "COUNT"});
  for (const auto& [reason, count] : counts) table.add({reason, std::to_string(count)});
  if (!table.empty()) std::printf("\n%s", table.text().c_str());
}

// Of the tests, in their order, the last one that was made; what came after it has left zeros.
enum class Stage { kNone, kCoarse, kFull, kSurface, kAppearance, kRoundTrip };

Stage stageReached(const MatchVerdict& v) {
  if (v.accepted) return Stage::kRoundTrip;
  if (v.reason == "coarse_alignment") return Stage::kCoarse;
  if (v.reason == "seen_through" || v.reason == "depth_disagrees") return Stage::kSurface;
  if (v.reason == "unlike" || v.reason == "featureless") return Stage::kAppearance;
  if (v.reason == "round_trip") return Stage::kRoundTrip;
  // These judge votes, whose own tests are theirs if they are told.
  if (v.reason == "contradiction" || v.reason == "rival") return v.inlier_ratio > 0 ? Stage::kRoundTrip : Stage::kNone;
  return Stage::kFull;
}

class MatchTable {
 public:
  void add(const MatchVerdict& v) {
    const Stage reached = stageReached(v);
    const auto from = [&](Stage stage, double value, int decimals) {
      return reached >= stage ? fixed(value, decimals) : std::string("-");
    };
    table_.add({toString(v.query), toString(v.candidate), v.accepted ? "accepted" : v.reason, failedText(v),
                from(Stage::kCoarse, v.fern_dissimilarity, 3), from(Stage::kCoarse, v.inlier_ratio, 3),
                from(Stage::kCoarse, v.rms_sigma, 2), from(Stage::kFull, v.degeneracy, 5),
                from(Stage::kFull, v.photometric_median, 1), from(Stage::kSurface, v.seen_through, 3),
                from(Stage::kAppearance, v.unlike, 2), from(Stage::kAppearance, v.features, 2),
                from(Stage::kRoundTrip, 1000 * v.round_trip_m, 1),
                from(Stage::kRoundTrip, v.round_trip_rad * 180 / std::numbers::pi, 2),
                fixed(v.T_candidate_query.translation().norm(), 3)});
  }
  /// `any`: whether there are others than these.
  void print(bool any) const {
    const char* none = any ? "no such matches\n"
                           : "nothing was judged: no keyframe looked enough like an earlier one, of another robot or "
                             "from elsewhere on its way, to be compared with it\n";
    const std::string text = table_.empty() ? none : table_.text();
    std::fwrite(text.data(), 1, text.size(), stdout);
  }

 private:
  TextTable table_{{"QUERY", "CANDIDATE", "VERDICT", "FAILED", "FERNS", "INLIERS", "RMS sigma", "DEGENERACY", "GREY",
                    "THROUGH", "UNLIKE", "FEATURES", "TRIP mm", "TRIP deg", "APART m"}};
};

// One document, written as its parts come: that of very many verdicts would not fit into memory.
Result<void> printJsonOf(const MapStore& store, const VerdictFilter& filter,
                         const std::map<std::string, size_t>& counts) {
  std::printf("{\n\"counts\": %s,\n\"matches\": [", nlohmann::json(counts).dump().c_str());
  const char* between = "\n";
  const auto all = store.eachVerdict(filter, [&](const MatchVerdict& verdict) {
    const std::string text = jsonOf(verdict).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    std::printf("%s%s", between, text.c_str());
    between = ",\n";
  });
  std::printf("\n]\n}\n");
  return all;
}

int run(const MatchesOptions& options) {
  const Result<MapStore> store = MapStore::open(options.store, MapStore::Mode::kReadOnly);
  if (!store) return failWithStore(store.error(), options.store);
  const auto moment = store->beginReading();
  if (!moment) return failWith(moment.error());
  if (!options.robot.empty()) {
    const auto robots = store->robots();
    if (!robots) return failWith(robots.error());
    if (std::find(robots->begin(), robots->end(), options.robot) == robots->end())
      return failWith({ErrorCode::kWrongUse,
                       options.store + ": holds no robot '" + printable(options.robot) + "', but " + listed(*robots)});
  }
  VerdictFilter filter{std::nullopt, options.reason, options.robot};
  if (options.refused) filter.accepted = false;
  const auto counts = store->verdictCounts(options.robot);
  if (!counts) return failWith(counts.error());
  // A word that no match was judged with is a slip, unless there is nothing to have judged.
  if (!options.reason.empty() && !counts->empty() && !counts->contains(options.reason)) {
    std::vector<std::string> words;
    for (const auto& [reason, count] : *counts) words.push_back(reason);
    return failWith({ErrorCode::kWrongUse, "--reason " + printable(options.reason) + ": no match" +
                                               (options.robot.empty() ? "" : " of robot " + options.robot) +
                                               " was judged so, but " + listed(words)});
  }
  if (options.json) {
    const auto printed = printJsonOf(*store, filter, *counts);
    return printed ? 0 : failWith(printed.error());
  }
  MatchTable table;
  if (auto all = store->eachVerdict(filter, [&](const MatchVerdict& verdict) { table.add(verdict); }); !all)
    return failWith(all.error());
  table.print(!counts->empty());
  printCounts(*counts);
  return 0;
}

}  // namespace

void addMatchesVerb(CLI::App& app, int& exit_code) {
  auto* verb = app.add_subcommand("matches", "Every place match that was judged, with the numbers it was judged by");
  verb->footer(
      "FERNS dissimilarity of the codes, INLIERS share of points that agree, RMS of their distance, DEGENERACY\n"
      "smallest to largest eigenvalue, GREY levels apart, THROUGH share of pixels seen through, UNLIKE share of\n"
      "textured patches that do not look alike, FEATURES share of patches with anything on them, TRIP there and back.\n"
      "FAILED is the number that the reason is about. Below the table: how many verdicts of each reason the store "
      "holds.\n"
      "Example: fleet matches run/map.comap --refused --reason inlier_ratio --robot a");
  auto options = std::make_shared<MatchesOptions>();
  verb->add_option("STORE", options->store, "Map store to read")->required();
  verb->add_flag("--refused", options->refused, "Only those that were refused");
  verb->add_option("--reason", options->reason, "Only those of this reason, such as inlier_ratio");
  verb->add_option("--robot", options->robot, "Only those with this robot on either side");
  verb->add_flag("--json", options->json, "Print one JSON document");
  verb->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace comap
