#include <cstdio>
#include <memory>

#include "fleet_tools/command_line/fail.h"
#include "fleet_tools/command_line/text_table.h"
#include "fleet_tools/command_line/verb.h"
#include "fleet_tools/store/record_json.h"
#include "mapping_core/store/store_survey.h"

namespace comap {
namespace {

struct DoctorArguments {
  std::string store;
  bool json = false;
};

nlohmann::json jsonOf(const StoreSurvey& survey) {
  return {{"store", survey.path},
          {"whole", survey.damage.empty()},
          {"keyframes", survey.keyframes.size()},
          {"lost_keyframes", survey.lost_keyframes},
          {"edges", survey.edges.size()},
          {"verdicts", survey.verdicts.size()},
          {"merges", survey.merges.size()},
          {"tiles", survey.tiles},
          {"damage", survey.damage},
          {"remarks", survey.remarks}};
}

int run(const DoctorArguments& arguments) {
  const auto survey = surveyStore(arguments.store);
  if (!survey) return failWith(survey.error());
  if (arguments.json) {
    printJson(jsonOf(*survey));
  } else {
    std::printf("%s: whole are %zu keyframes, %zu edges, %zu verdicts, %zu merges, %zu tiles\n", survey->path.c_str(),
                survey->keyframes.size(), survey->edges.size(), survey->verdicts.size(), survey->merges.size(),
                survey->tiles);
    for (const std::string& text : survey->damage) std::printf("damage: %s\n", printable(text).c_str());
    for (const std::string& text : survey->remarks) std::printf("remark: %s\n", printable(text).c_str());
    if (!survey->damage.empty())
      std::printf("'fleet recover %s --out NEW' saves what is whole\n", survey->path.c_str());
  }
  return survey->damage.empty() ? 0 : 1;
}

}  // namespace

void addDoctorVerb(CLI::App& app, int& exit_code) {
  auto* verb = app.add_subcommand("doctor", "Whether a store is whole, and what is damaged if it is not");
  verb->footer(
      "Reads every page and every row: checksums, whether keyframes can be read, edges to keyframes that are not\n"
      "there. Exit code 1 if there is damage. Gaps in a robot's sequences are remarked; they may be still to come.\n"
      "Example: fleet doctor run/map.comap");
  auto arguments = std::make_shared<DoctorArguments>();
  verb->add_option("STORE", arguments->store, "Map store")->required();
  verb->add_flag("--json", arguments->json, "Print one JSON document");
  verb->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace comap
