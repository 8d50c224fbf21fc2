#include <cstdio>
#include <filesystem>
#include <memory>

#include "fleet_tools/command_line/fail.h"
#include "fleet_tools/command_line/progress.h"
#include "fleet_tools/command_line/text_table.h"
#include "fleet_tools/command_line/verb.h"
#include "fleet_tools/store/record_json.h"
#include "mapping_core/store/schema.h"
#include "mapping_core/store/store_glance.h"
#include "mapping_core/store/store_leavings.h"
#include "mapping_core/store/store_survey.h"

namespace comap {
namespace {

constexpr uintmax_t kSmallBytes = 64 << 20;  // read whole in a second

struct DoctorArguments {
  std::string store;
  bool full = false, json = false;
};

nlohmann::json jsonOf(const StoreSurvey& survey) {
  return {{"store", survey.path},
          {"whole", survey.damage.empty()},
          {"read_all", true},
          {"keyframes", survey.keyframes.size()},
          {"lost_keyframes", survey.lost_keyframes},
          {"edges", survey.edges.size()},
          {"verdicts", survey.verdicts.size()},
          {"merges", survey.merges.size()},
          {"tiles", survey.tiles},
          {"pictures_read", survey.keyframes.size() + survey.lost_keyframes},
          {"tiles_read", survey.tiles},
          {"damage", survey.damage},
          {"remarks", survey.remarks}};
}

// "whole" and "lost_keyframes" are not known without reading all, but for damage that was seen.
nlohmann::json jsonOf(const StoreGlance& glance) {
  return {{"store", glance.path},
          {"whole", glance.damage.empty() ? nlohmann::json() : nlohmann::json(false)},
          {"read_all", false},
          {"keyframes", glance.keyframes},
          {"lost_keyframes", nullptr},
          {"edges", glance.edges},
          {"verdicts", glance.verdicts},
          {"merges", glance.merges},
          {"tiles", glance.tiles},
          {"pictures_read", glance.pictures_read},
          {"tiles_read", glance.tiles_read},
          {"damage", glance.damage},
          {"remarks", glance.remarks}};
}

void printFound(const std::string& store, const std::vector<std::string>& remarks,
                const std::vector<std::string>& damage) {
  for (const std::string& text : remarks) std::printf("remark: %s\n", printable(text).c_str());
  for (const std::string& text : damage) std::printf("damage: %s\n", printable(text).c_str());
  if (!damage.empty()) std::printf("'fleet recover %s --out NEW' saves what is whole\n", printable(store).c_str());
}

void print(const StoreSurvey& survey) {
  std::printf("%s: %s; %zu keyframes, %zu edges, %zu verdicts, %zu merges, %zu tiles\n", printable(survey.path).c_str(),
              survey.damage.empty() ? "whole, every byte was read" : "damaged; whole are", survey.keyframes.size(),
              survey.edges.size(), survey.verdicts.size(), survey.merges.size(), survey.tiles);
  printFound(survey.path, survey.remarks, survey.damage);
}

void print(const StoreGlance& glance) {
  std::printf("%s: %s; %zu keyframes, %zu edges, %zu verdicts, %zu merges, %zu tiles\n", printable(glance.path).c_str(),
              glance.damage.empty() ? "no damage seen" : "damaged", glance.keyframes, glance.edges, glance.verdicts,
              glance.merges, glance.tiles);
  std::printf(
      "looked at: every row, held against its checksum, %zu of the pictures, %zu of the tiles\n"
      "not read: the other pictures and tiles; 'fleet doctor --full %s' reads all %s\n",
      glance.pictures_read, glance.tiles_read, printable(glance.path).c_str(),
      humanBytes(static_cast<double>(glance.bytes)).c_str());
  printFound(glance.path, glance.remarks, glance.damage);
}

// Of a file of which nothing can be told. One whose first page says that it is of another version cannot be saved.
Error advised(const std::string& store, Error error) {
  if (error.code == ErrorCode::kBadData && !storeVersionOf(store))
    error.text += "; if it was a map store, 'fleet recover " + store + " --out NEW' looks for what is whole";
  return error;
}

template <class Found>
int tell(const std::string& store, Result<Found> found, bool taken_back, bool json) {
  if (!found) return failWith(advised(store, found.error()));
  if (taken_back)
    found->remarks.insert(found->remarks.begin(),
                          "its writer was killed within a change, as it opened or closed the store: that change is "
                          "taken back, and nothing else was written");
  if (json) {
    printJson(jsonOf(*found));
  } else {
    print(*found);
  }
  return found->damage.empty() ? 0 : 1;
}

int run(const DoctorArguments& arguments) {
  const bool taken_back = takeBackHalfChange(arguments.store);  // else it cannot be read
  std::error_code none;
  const uintmax_t bytes = std::filesystem::file_size(arguments.store, none);
  if (!arguments.full && !none && bytes > kSmallBytes)
    return tell(arguments.store, glanceAtStore(arguments.store), taken_back, arguments.json);
  auto survey = [&] {
    Progress progress("reading keyframes");
    return surveyStore(arguments.store, [&](size_t done, size_t all) { progress.show(done, all); });
  }();
  return tell(arguments.store, std::move(survey), taken_back, arguments.json);
}

}  // namespace

void addDoctorVerb(CLI::App& app, int& exit_code) {
  auto* verb = app.add_subcommand("doctor", "Whether a store is whole, and what is damaged if it is not");
  verb->footer(
      "A store of up to 64 MB is read whole: every page and row, each row held against its checksum, whether\n"
      "keyframes can be read, edges to keyframes that are not there. Of a larger one, every row, and some of the\n"
      "pictures and tiles; what was not read is said, and --full reads it. Exit code 1 if there is damage. Gaps in a\n"
      "robot's sequences are remarked; they may be still to come.\n"
      "Example: fleet doctor run/map.comap");
  auto arguments = std::make_shared<DoctorArguments>();
  verb->add_option("STORE", arguments->store, "Map store")->required();
  verb->add_flag("--full", arguments->full, "Read every byte, however large the store is");
  verb->add_flag("--json", arguments->json, "Print one JSON document");
  verb->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace comap
