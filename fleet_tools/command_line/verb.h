// One verb of `fleet` a file. Each adds itself to the command line and, if chosen, leaves an exit code.
#pragma once

#include <CLI/CLI.hpp>

namespace comap {

/// `exit_code`: 0 ok, 1 problem found, 2 wrong use, 3 cannot reach or read. Verbs print errors to stderr themselves
/// by failWith().
void addSynthVerb(CLI::App& app, int& exit_code);
void addReplayVerb(CLI::App& app, int& exit_code);
void addEvaluateVerb(CLI::App& app, int& exit_code);
void addExportVerb(CLI::App& app, int& exit_code);
void addRenderVerb(CLI::App& app, int& exit_code);
void addInfoVerb(CLI::App& app, int& exit_code);
void addMatchesVerb(CLI::App& app, int& exit_code);
void addMergesVerb(CLI::App& app, int& exit_code);
void addSplitVerb(CLI::App& app, int& exit_code);
void addFinishVerb(CLI::App& app, int& exit_code);
void addForgetVerb(CLI::App& app, int& exit_code);
void addDiscoveryVerb(CLI::App& app, int& exit_code);
void addKeysVerb(CLI::App& app, int& exit_code);
void addDoctorVerb(CLI::App& app, int& exit_code);
void addRecoverVerb(CLI::App& app, int& exit_code);
void addViewVerb(CLI::App& app, int& exit_code);
void addWatchVerb(CLI::App& app, int& exit_code);
void addManVerb(CLI::App& app, int& exit_code);
void addCompletionVerb(CLI::App& app, int& exit_code);

}  // namespace comap
