// The fleet's tools: one program, one verb a task.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

#include "fleet_tools/verb.h"

namespace {

void addVerbs(CLI::App& app, int& exit_code) {
  comap::addSynthVerb(app, exit_code);
  comap::addReplayVerb(app, exit_code);
  comap::addEvaluateVerb(app, exit_code);
  comap::addExportVerb(app, exit_code);
  comap::addRenderVerb(app, exit_code);
  comap::addInfoVerb(app, exit_code);
  comap::addMatchesVerb(app, exit_code);
  comap::addMergesVerb(app, exit_code);
  comap::addSplitVerb(app, exit_code);
  comap::addForgetVerb(app, exit_code);
  comap::addKeysVerb(app, exit_code);
  comap::addDoctorVerb(app, exit_code);
  comap::addRecoverVerb(app, exit_code);
  comap::addViewVerb(app, exit_code);
  comap::addWatchVerb(app, exit_code);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Tools for a fleet of robots that map together.", "fleet");
  app.set_version_flag("--version", "fleet " COMAP_VERSION);
  app.require_subcommand(1);
  app.footer(
      "Exit codes: 0 ok, 1 problem found, 2 wrong use, 3 cannot reach or read.\n"
      "'fleet VERB --help' tells more and gives an example.");
  int exit_code = 0;
  addVerbs(app, exit_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "fleet: %s\n", error.what());
    return 3;
  }
  return exit_code;
}
