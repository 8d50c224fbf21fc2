#include <cstdio>
#include <future>
#include <memory>

#include "fleet_tools/command_line/fail.h"
#include "fleet_tools/command_line/progress.h"
#include "fleet_tools/command_line/text_table.h"
#include "fleet_tools/command_line/verb.h"
#include "fleet_tools/store/record_json.h"
#include "fleet_tools/store/store_change.h"
#include "fleet_tools/store/store_draft.h"
#include "mapping_core/store/lent_schema.h"
#include "mapping_core/store/store_leavings.h"
#include "mapping_core/store/store_lock.h"
#include "mapping_core/store/store_survey.h"
#include "protocol/storage/first_page.h"

namespace comap {
namespace {

struct RecoverArguments {
  std::string damaged;
  StoreChange change;  // of the new store
};

// Whether nothing can be told of it but that it is damaged, as where its first page is.
bool tellsNothing(const Result<StoreSurvey>& survey) {
  if (!survey) return survey.error().code == ErrorCode::kBadData;
  return survey->keyframes.empty() && !survey->damage.empty();
}

// Where not even their number can be told, none is: it may be any.
Error nothingSaved(const std::string& damaged, const StoreSurvey& survey) {
  std::string text = damaged + ": no keyframe can be saved, ";
  text += survey.lost_keyframes > 0 ? counted(survey.lost_keyframes, "keyframe") + " lost"
                                    : "and how many there were cannot be told";
  if (const std::string cut_off = cutOffText(damaged); !cut_off.empty()) text += "; " + cut_off;
  return {ErrorCode::kProblem, text + "; 'fleet doctor' tells what is damaged"};
}

// It is copied while it is looked at: most stores are whole but for a few rows, if any.
Result<StoreSurvey> save(const RecoverArguments& arguments) {
  auto draft = StoreDraft::begin(arguments.change.store, arguments.damaged);
  if (!draft) return draft.error();
  const LeavingsGuard guard(arguments.damaged);
  const auto lock = StoreLock::take(arguments.damaged);
  if (!lock) return lock.error();
  const bool half_changed = hasJournal(arguments.damaged);
  const std::vector<std::string> of_head = headDamage(arguments.damaged);
  const auto source = half_changed || !of_head.empty() ? draft->copySource() : Result<std::string>(arguments.damaged);
  if (!source) return source.error();
  if (!of_head.empty()) (void)mendHead(*source);
  if (half_changed)
    std::fprintf(stderr, "fleet: %s: its writer was killed within a change, which is not saved\n",
                 printable(arguments.damaged).c_str());
  auto copied = std::async(std::launch::async, copyUnseen, *source, draft->path());
  auto progress = std::make_unique<Progress>("reading keyframes");
  const auto show = [&](size_t done, size_t all) { progress->show(done, all); };
  auto survey = surveyStore(*source, show, SurveyDepth::kRows);
  const bool is_copied = copied.get();
  if (!is_copied && tellsNothing(survey)) {
    const auto copy = *source == arguments.damaged ? draft->copySource() : source;
    if (!copy) return copy.error();
    if (auto lent = surveyWithLentSchema(*copy, show)) survey = std::move(*lent);
  }
  progress.reset();
  if (!survey) return survey;
  survey->damage.insert(survey->damage.begin(), of_head.begin(), of_head.end());
  if (survey->keyframes.empty() && !survey->damage.empty()) return nothingSaved(arguments.damaged, *survey);
  if (auto saved = saveWhole(*survey, draft->path(), is_copied); !saved) return saved.error();
  if (auto moved = draft->publish(); !moved) return moved.error();
  return survey;
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
      "The damaged store stays as it is. If its writer was killed within a change, that is taken back in a copy "
      "beside\n"
      "NEW, which takes the store's room until all is saved. Poses, surfels and tiles are computed anew from the\n"
      "keyframes and edges that could be saved; a map whose ties are lost comes out in parts. Robots whose outbox "
      "still\n"
      "holds what was lost deliver it to a core on the new store only if the core had not yet acknowledged it.\n"
      "Example: fleet recover flat.comap --out flat-saved.comap");
  auto arguments = std::make_shared<RecoverArguments>();
  verb->add_option("STORE", arguments->damaged, "Damaged map store that no core is writing")->required();
  verb->add_option("--out", arguments->change.store, "New store; a file that is there is refused")->required();
  addStoreChangeOptions(*verb, arguments->change);
  verb->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace comap
