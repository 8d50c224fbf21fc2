// The fleet's tools: one program, one verb a task.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

#include "fleet_tools/verb.h"

namespace {

void addVerbs([[maybe_unused]] CLI::App& app, [[maybe_unused]] int& exit_code) {
#ifdef COMAP_HAS_SYNTH_VERB
  comap::addSynthVerb(app, exit_code);
#endif
#ifdef COMAP_HAS_REPLAY_VERB
  comap::addReplayVerb(app, exit_code);
#endif
#ifdef COMAP_HAS_EVALUATE_VERB
  comap::addEvaluateVerb(app, exit_code);
#endif
#ifdef COMAP_HAS_EXPORT_VERB
  comap::addExportVerb(app, exit_code);
#endif
#ifdef COMAP_HAS_RENDER_VERB
  comap::addRenderVerb(app, exit_code);
#endif
#ifdef COMAP_HAS_INFO_VERB
  comap::addInfoVerb(app, exit_code);
#endif
#ifdef COMAP_HAS_MATCHES_VERB
  comap::addMatchesVerb(app, exit_code);
#endif
#ifdef COMAP_HAS_MERGES_VERB
  comap::addMergesVerb(app, exit_code);
#endif
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
