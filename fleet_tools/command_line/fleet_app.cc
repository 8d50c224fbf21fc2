#include "fleet_tools/command_line/fleet_app.h"

#include "fleet_tools/command_line/verb.h"
#include "protocol/program/service_arguments.h"

namespace comap {

std::unique_ptr<CLI::App> makeFleetApp(int& exit_code) {
  auto app = std::make_unique<CLI::App>("Tools for a fleet of robots that map together.", "fleet");
  app->set_version_flag("--version", "fleet " COMAP_VERSION);
  app->require_subcommand(1);
  app->footer(
      "Exit codes: 0 ok, 1 problem found, 2 wrong use, 3 cannot reach or read.\n"
      "'fleet VERB --help' tells more and gives an example.");
  for (const auto add :
       {addSynthVerb, addReplayVerb, addEvaluateVerb, addExportVerb, addRenderVerb, addViewVerb, addWatchVerb,
        addInfoVerb, addMatchesVerb, addMergesVerb, addSplitVerb, addForgetVerb, addFinishVerb, addKeysVerb,
        addDiscoveryVerb, addDoctorVerb, addRecoverVerb, addManVerb, addCompletionVerb})
    add(*app, exit_code);
  refuseEmptyValues(*app);
  return app;
}

}  // namespace comap
