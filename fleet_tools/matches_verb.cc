#include <cstdio>
#include <memory>
#include <numbers>

#include "fleet_tools/fail.h"
#include "fleet_tools/record_json.h"
#include "fleet_tools/text_table.h"
#include "fleet_tools/verb.h"
#include "mapping_core/store/map_store.h"

namespace comap {
namespace {

struct MatchesOptions {
  std::string store;
  bool refused = false, json = false;
};

void print(const std::vector<MatchVerdict>& verdicts) {
  if (verdicts.empty()) {
    std::printf("no such matches\n");
    return;
  }
  TextTable table({"QUERY", "CANDIDATE", "VERDICT", "FERNS", "INLIERS", "RMS sigma", "DEGENERACY", "GREY", "THROUGH",
                   "TRIP mm", "TRIP deg", "APART m"});
  for (const MatchVerdict& v : verdicts) {
    table.add({toString(v.query), toString(v.candidate), v.accepted ? "accepted" : v.reason,
               fixed(v.fern_dissimilarity, 3), fixed(v.inlier_ratio, 3), fixed(v.rms_sigma, 2), fixed(v.degeneracy, 5),
               fixed(v.photometric_median, 1), fixed(v.seen_through, 3), fixed(1000 * v.round_trip_m, 1),
               fixed(v.round_trip_rad * 180 / std::numbers::pi, 2),
               fixed(v.T_candidate_query.translation().norm(), 3)});
  }
  std::printf("%s", table.text().c_str());
}

int run(const MatchesOptions& options) {
  const Result<MapStore> store = MapStore::open(options.store, MapStore::Mode::kReadOnly);
  if (!store) return failWith(store.error());
  Result<std::vector<MatchVerdict>> verdicts = store->verdicts();
  if (!verdicts) return failWith(verdicts.error());
  if (options.refused) std::erase_if(*verdicts, [](const MatchVerdict& v) { return v.accepted; });
  if (!options.json) {
    print(*verdicts);
    return 0;
  }
  nlohmann::json matches = nlohmann::json::array();
  for (const MatchVerdict& verdict : *verdicts) matches.push_back(jsonOf(verdict));
  printJson({{"matches", matches}});
  return 0;
}

}  // namespace

void addMatchesVerb(CLI::App& app, int& exit_code) {
  auto* verb = app.add_subcommand("matches", "Every place match that was judged, with the numbers it was judged by");
  verb->footer(
      "FERNS dissimilarity of the codes, INLIERS share of points that agree, RMS of their distance, DEGENERACY\n"
      "smallest to largest eigenvalue, GREY levels apart, THROUGH share of pixels seen through, TRIP there and back.\n"
      "Example: fleet matches run/map.comap --refused");
  auto options = std::make_shared<MatchesOptions>();
  verb->add_option("STORE", options->store, "Map store to read")->required();
  verb->add_flag("--refused", options->refused, "Only those that were refused");
  verb->add_flag("--json", options->json, "Print one JSON document");
  verb->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace comap
