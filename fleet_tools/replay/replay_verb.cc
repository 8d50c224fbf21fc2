#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "fleet_tools/command_line/fail.h"
#include "fleet_tools/command_line/verb.h"
#include "fleet_tools/evaluate/compare.h"
#include "fleet_tools/replay/interruption.h"
#include "fleet_tools/replay/replay_arguments.h"
#include "fleet_tools/replay/run_folder.h"
#include "fleet_tools/replay/run_outputs.h"
#include "fleet_tools/replay/run_series.h"
#include "fleet_tools/replay/run_summary.h"
#include "protocol/types/counted.h"

namespace comap {
namespace {

// How far a run is, in one line of a terminal; nothing where standard error is none.
class ProgressLine {
 public:
  ReplayProgress writer() const {
    return [terminal = terminal_](const std::string& stage, size_t done, size_t all) {
      if (terminal) std::fprintf(stderr, "\r\033[K%s: %zu of %zu", stage.c_str(), done, all);
    };
  }
  void clear() const {
    if (terminal_) std::fprintf(stderr, "\r\033[K");
  }

 private:
  const bool terminal_ = isatty(STDERR_FILENO) != 0;
};

int runOnce(const ReplayArguments& arguments) {
  const ProgressLine progress;
  if (arguments.mode == "paper") {
    auto report = replayPaper(arguments.options, arguments.paper, progress.writer());
    progress.clear();
    if (!report) return failWith(report.error());
    if (arguments.json)
      std::printf("%s\n", report->dump(2).c_str());
    else
      printPaperSummary(*report, arguments.options.out);
    return 0;
  }
  auto outcome = arguments.link == "dds" ? replayDds(arguments.options, progress.writer())
                                         : replayLoopback(arguments.options, progress.writer());
  progress.clear();
  if (!outcome) return failWith(outcome.error());
  auto report = writeRunOutputs(arguments.options, *outcome);
  if (!report) return failWith(report.error());
  if (arguments.json)
    std::printf("%s\n", report->dump(2).c_str());
  else
    printRunSummary(*report, arguments.options.out);
  return failIfIncomplete(*report);
}

// What decides what comes out of several runs in one folder.
nlohmann::json planOf(const ReplayArguments& arguments) {
  const ReplayOptions& options = arguments.options;
  return {{"version", COMAP_VERSION},
          {"runs", arguments.side_by_side ? "compare" : "seeds"},
          {"mode", arguments.side_by_side ? "both" : arguments.mode},
          {"link", arguments.link},
          {"robots", arguments.robots},
          {"fixes", arguments.fixes},
          {"truths", arguments.truths},
          {"surface", arguments.compare.truth.surface},
          {"device", options.device},
          {"realtime", options.realtime},
          {"keys", options.keys}};
}

Result<RunSeries> beginSeries(const ReplayArguments& arguments) {
  const std::string& out = arguments.options.out;
  auto series = RunSeries::begin(out, planOf(arguments), arguments.overwrite);
  if (!series) return series;
  tellWhenInterrupted("the finished runs in " + out + " are kept; the same command goes on with the others");
  if (const size_t finished = series->finishedBefore(); finished > 0)
    std::fprintf(stderr, "fleet: %s: %s %s finished before; --overwrite begins anew\n", out.c_str(),
                 counted(finished, "run").c_str(), wordFor(finished, "was", "were"));
  return series;
}

// As it was told when it ended.
int tellFinished(const ReplayArguments& arguments, int exit_code) {
  const auto report = readReport(arguments.options.out);
  if (!report) return failWith(report.error());
  if (arguments.json)
    std::printf("%s\n", report->dump(2).c_str());
  else if (arguments.mode == "paper")
    printPaperSummary(*report, arguments.options.out);
  else
    printRunSummary(*report, arguments.options.out);
  return exit_code;
}

// A run a seed in seed-1, seed-2 ...; the first book is the standard one. The exit code is the worst one. What ends a
// run before it has come to anything is no reason to keep it.
int runSeeds(const ReplayArguments& arguments) {
  auto series = beginSeries(arguments);
  if (!series) return failWith(series.error());
  int worst = 0;
  for (int seed = 0; seed < arguments.seeds; ++seed) {
    ReplayArguments one = arguments;
    one.options.out += "/seed-" + std::to_string(seed + 1);
    one.options.fern_seed += static_cast<uint32_t>(seed);
    const auto finished = series->takeUp(one.options.out);
    if (!finished) return failWith(finished.error());
    const int code = *finished ? tellFinished(one, **finished) : runOnce(one);
    worst = std::max(worst, code);
    if (*finished || !std::filesystem::exists(one.options.out + "/report.html")) continue;
    if (auto noted = series->finish(one.options.out, code); !noted) return failWith(noted.error());
  }
  return worst;
}

int runCompare(ReplayArguments& arguments) {
  auto series = beginSeries(arguments);
  if (!series) return failWith(series.error());
  std::fprintf(stderr, "fleet: %s, one after the other\n",
               counted(runsOf(arguments.options.robots, arguments.compare), "run").c_str());
  const ProgressLine progress;
  const auto comparison =
      replayCompare(arguments.options, arguments.paper, arguments.compare, *series, progress.writer());
  progress.clear();
  if (!comparison) return failWith(comparison.error());
  if (arguments.json)
    std::printf("%s\n", comparison->dump(2).c_str());
  else
    std::printf("%srun: %s (graph, paper, compare.json, compare.html)\n", compareText(*comparison).c_str(),
                arguments.options.out.c_str());
  return 0;
}

int run(ReplayArguments& arguments) {
  if (auto checked = checkReplay(arguments); !checked) return failWith(checked.error());
  if (arguments.side_by_side) return runCompare(arguments);
  if (arguments.seeds > 0) return runSeeds(arguments);
  if (auto prepared = prepareRunFolder(arguments.options.out, arguments.overwrite); !prepared)
    return failWith(prepared.error());
  tellWhenInterrupted("the run in " + arguments.options.out +
                      " is not complete; the same command with --overwrite begins it anew");
  return runOnce(arguments);
}

}  // namespace

void addReplayVerb(CLI::App& app, int& exit_code) {
  auto* verb = app.add_subcommand("replay", "Run robots and core on recorded data sets");
  verb->footer(
      "Example: fleet replay --robot a=data/flat/a --robot b=data/flat/b@0:150 --out run\n"
      "Then:    fleet evaluate run --truth a=data/flat/a/groundtruth.txt --truth b=data/flat/b/groundtruth.txt");
  auto arguments = std::make_shared<ReplayArguments>();
  addReplayOptions(*verb, *arguments);
  verb->callback([arguments, verb, &exit_code] {
    arguments->link_given = verb->count("--link") > 0;
    arguments->mode_given = verb->count("--mode") > 0;
    if (arguments->mode == "paper" && !arguments->link_given) arguments->link = "loopback";
    exit_code = run(*arguments);
  });
}

}  // namespace comap
