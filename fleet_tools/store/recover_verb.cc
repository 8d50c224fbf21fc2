#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>

#include "fleet_tools/command_line/fail.h"
#include "fleet_tools/command_line/progress.h"
#include "fleet_tools/command_line/text_table.h"
#include "fleet_tools/command_line/verb.h"
#include "fleet_tools/store/record_json.h"
#include "fleet_tools/store/store_change.h"
#include "mapping_core/gpu/device.h"
#include "mapping_core/store/store_lock.h"
#include "mapping_core/store/store_survey.h"

namespace comap {
namespace {

struct RecoverArguments {
  std::string damaged;
  StoreChange change;  // of the new store
};

void removeStore(const std::string& path) {
  std::error_code ignored;
  for (const char* part : {"", "-wal", "-shm"}) std::filesystem::remove(path + part, ignored);
}

// Under another name until all that is whole is in it: half of it would look like a whole store.
Result<StoreSurvey> save(const RecoverArguments& arguments) {
  std::error_code code;
  if (std::filesystem::exists(arguments.change.store, code))
    return Error{ErrorCode::kWrongUse, "--out " + arguments.change.store + ": is there already; choose a new name"};
  const auto lock = StoreLock::take(arguments.damaged);
  if (!lock) return lock.error();
  auto survey = [&] {
    Progress progress("reading keyframes");
    return surveyStore(arguments.damaged, [&](size_t done, size_t all) { progress.show(done, all); });
  }();
  if (!survey) return survey;
  if (survey->keyframes.empty() && !survey->damage.empty())
    return Error{ErrorCode::kProblem, arguments.damaged + ": no keyframe can be saved, " +
                                          counted(survey->lost_keyframes, "keyframe") +
                                          " lost; 'fleet doctor' tells what is damaged"};
  const std::string draft = arguments.change.store + ".part";
  removeStore(draft);  // of a start that was interrupted
  {
    auto store = MapStore::open(draft, MapStore::Mode::kCreateOrOpen);
    if (!store) return store.error();
    if (auto saved = saveWhole(*survey, *store); !saved) {
      store = Error{saved.error()};  // closes it
      removeStore(draft);
      return saved.error();
    }
  }
  std::filesystem::rename(draft, arguments.change.store, code);
  if (code) return Error{ErrorCode::kUnreachable, draft + ": cannot be renamed: " + code.message()};
  return survey;
}

// Before anything is written, so that the same command can be given again.
Result<void> checkDevice(const StoreChange& change) {
  if (change.later) return {};
  gpu::DeviceOptions options;
  options.choice = change.device;
  const auto device = gpu::Device::create(options);
  return device ? Result<void>() : Result<void>(device.error());
}

int run(const RecoverArguments& arguments) {
  const auto config = configOf(arguments.change);
  if (!config) return failWith(config.error());
  if (auto checked = checkDevice(arguments.change); !checked) return failWith(checked.error());
  const auto survey = save(arguments);
  if (!survey) return failWith(survey.error());
  if (!arguments.change.json) {
    for (const std::string& text : survey->damage) std::printf("damage: %s\n", printable(text).c_str());
    std::printf("whole: %zu keyframes, %zu edges, %zu verdicts, %zu merges; saved in %s\n", survey->keyframes.size(),
                survey->edges.size(), survey->verdicts.size(), survey->merges.size(), arguments.change.store.c_str());
  }
  auto store = MapStore::open(arguments.change.store, MapStore::Mode::kOpen);
  if (!store) return failWith(store.error());
  // What lost its ties falls apart, and what accepted matches still say joins it again.
  return followUp(arguments.change, *config, *store,
                  {{"keyframes", survey->keyframes.size()},
                   {"lost_keyframes", survey->lost_keyframes},
                   {"damage", survey->damage}});
}

}  // namespace

void addRecoverVerb(CLI::App& app, int& exit_code) {
  auto* verb = app.add_subcommand("recover", "Save what is whole of a damaged store into a new one");
  verb->footer(
      "The damaged store stays as it is. Poses, surfels and tiles are computed anew from the keyframes and edges that\n"
      "could be saved; a map whose ties are lost comes out in parts. Robots whose outbox still holds what was lost\n"
      "deliver it to a core on the new store only if the core had not yet acknowledged it.\n"
      "Example: fleet recover flat.comap --out flat-saved.comap");
  auto arguments = std::make_shared<RecoverArguments>();
  verb->add_option("STORE", arguments->damaged, "Damaged map store that no core is writing")->required();
  verb->add_option("--out", arguments->change.store, "New store")->required();
  addStoreChangeOptions(*verb, arguments->change);
  verb->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace comap
