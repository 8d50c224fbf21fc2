#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <memory>
#include <set>

#include "edge_agent/capture/source_uri.h"
#include "fleet_tools/command_line/fail.h"
#include "fleet_tools/command_line/verb.h"
#include "fleet_tools/evaluate/compare.h"
#include "fleet_tools/replay/compare_truth.h"
#include "fleet_tools/replay/replay.h"
#include "fleet_tools/replay/replay_compare.h"
#include "fleet_tools/replay/run_folder.h"
#include "fleet_tools/replay/run_outputs.h"
#include "fleet_tools/replay/run_series.h"
#include "fleet_tools/replay/run_summary.h"
#include "mapping_core/surfels/seen_times.h"
#include "protocol/keys/credentials.h"
#include "protocol/types/counted.h"

namespace comap {
namespace {

// A signal's handler may use nothing but this.
std::string interrupted_text;  // NOLINT: written once, before the handler is there

void onInterrupt(int signal) {
  [[maybe_unused]] const auto written = write(STDERR_FILENO, interrupted_text.data(), interrupted_text.size());
  std::signal(signal, SIG_DFL);
  raise(signal);
}

// The run ends by the signal, as it would have.
void tellWhenInterrupted(const std::string& what) {
  interrupted_text = (isatty(STDERR_FILENO) != 0 ? "\n" : "") + ("fleet: interrupted: " + what + "\n");
  std::signal(SIGINT, onInterrupt);
  std::signal(SIGTERM, onInterrupt);
}

struct ReplayArguments {
  std::vector<std::string> robots;
  std::string link = "dds", mode = "graph";
  ReplayOptions options;
  PaperOptions paper;
  std::vector<std::string> fixes;
  CompareOptions compare;
  bool side_by_side = false, link_given = false, mode_given = false;
  std::vector<std::string> truths;
  int seeds = 0;  // 0: one run, in --out itself
  bool overwrite = false, json = false;
};

Result<std::vector<ReplayRobot>> parseRobots(const std::vector<std::string>& texts) {
  std::vector<ReplayRobot> robots;
  std::set<std::string> names;
  for (const std::string& text : texts) {
    const size_t equals = text.find('=');
    if (equals == std::string::npos)
      return Error{ErrorCode::kWrongUse, "--robot " + text + ": expected NAME=DIR[@FIRST:LAST]"};
    const ReplayRobot robot{text.substr(0, equals), text.substr(equals + 1)};
    if (const std::string problem = robotNameProblem(robot.name); !problem.empty())
      return Error{ErrorCode::kWrongUse, "--robot " + text + ": " + problem};
    if (!names.insert(robot.name).second)
      return Error{ErrorCode::kWrongUse, "--robot " + text + ": there is a robot " + robot.name + " already"};
    robots.push_back(robot);
  }
  return robots;
}

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

// Before anything is started: the core's and each robot's.
Result<void> checkKeysFor(const ReplayOptions& options) {
  if (options.keys.empty()) return {};
  std::vector<std::string> names = {"core"};
  for (const ReplayRobot& robot : options.robots) names.push_back(robot.name);
  for (const std::string& name : names) {
    const auto owner = checkCredentials(credentialsIn(options.keys + "/" + name), std::time(nullptr));
    if (!owner) return Error{owner.error().code, "--keys " + options.keys + ": " + owner.error().text};
  }
  return {};
}

int run(ReplayArguments& arguments) {
  if (arguments.side_by_side) {
    if (arguments.seeds > 0) return failWith({ErrorCode::kWrongUse, "--compare: takes no --seeds"});
    if (arguments.link_given && arguments.link != "loopback")
      return failWith({ErrorCode::kWrongUse, "--compare: runs over --link loopback only"});
    if (arguments.mode_given) return failWith({ErrorCode::kWrongUse, "--compare: runs both modes, takes no --mode"});
    arguments.link = "loopback";
    if (arguments.compare.ablation && !arguments.fixes.empty())
      return failWith({ErrorCode::kWrongUse, "--ablation: chooses the remedies itself, takes no --fix"});
  } else if (arguments.compare.alone || arguments.compare.sets || arguments.compare.ablation ||
             !arguments.truths.empty() || !arguments.compare.truth.surface.empty()) {
    return failWith({ErrorCode::kWrongUse, "--alone, --sets, --ablation, --truth, --surface: belong to --compare"});
  }
  if (!arguments.fixes.empty() && arguments.mode != "paper" && !arguments.side_by_side)
    return failWith({ErrorCode::kWrongUse, "--fix: belongs to --mode paper"});
  if (arguments.mode == "paper" && arguments.link == "dds")
    return failWith({ErrorCode::kWrongUse, "--mode paper: runs over --link loopback only"});
  if (arguments.options.realtime && arguments.link == "loopback")
    return failWith({ErrorCode::kWrongUse, "--realtime: loopback has no clock; use --link dds"});
  if (!arguments.options.keys.empty() && arguments.link == "loopback")
    return failWith({ErrorCode::kWrongUse, "--keys: loopback has no wire to encrypt; use --link dds"});
  auto robots = parseRobots(arguments.robots);
  if (!robots) return failWith(robots.error());
  for (const PaperFix& fix : kPaperFixes)
    arguments.paper.fixes.*fix.chosen = std::ranges::count(arguments.fixes, fix.name) > 0;
  arguments.options.robots = std::move(*robots);
  // Before a folder is made: a wrong source is the most common mistake.
  for (const ReplayRobot& robot : arguments.options.robots) {
    auto source = openSource(robot.source);
    if (!source) return failWith({source.error().code, "robot " + robot.name + ": " + source.error().text});
    if ((*source)->live())
      return failWith(
          {ErrorCode::kWrongUse,
           "robot " + robot.name + ": a camera cannot be replayed, record it first: " + "edge_agent --record"});
  }
  if (arguments.side_by_side) {
    auto truths = parseTruths(arguments.truths);
    if (!truths) return failWith(truths.error());
    arguments.compare.truth.trajectories = std::move(*truths);
    if (auto checked = checkCompare(arguments.options.robots, arguments.compare.truth); !checked)
      return failWith(checked.error());
  }
  if (arguments.mode == "paper" && arguments.options.robots.size() > kMostCameras)
    return failWith({ErrorCode::kWrongUse, "--mode paper: " + std::to_string(arguments.options.robots.size()) +
                                               " robots, expected at most " + std::to_string(kMostCameras)});
  if (auto checked = checkKeysFor(arguments.options); !checked) return failWith(checked.error());
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
  verb->add_option("--robot", arguments->robots, "NAME=DIR[@FIRST:LAST], a TUM-format folder; once a robot")
      ->required();
  verb->add_option("--out", arguments->options.out, "Folder for the run")->required();
  auto* link =
      verb->add_option("--link", arguments->link,
                       "dds: real processes, real DDS; loopback: one process, fixed order (--mode paper has only this)")
          ->check(CLI::IsMember({"loopback", "dds"}))
          ->capture_default_str();
  auto* mode =
      verb->add_option("--mode", arguments->mode,
                       "How the core maps: graph, or paper (the published method, every frame sent to the core)")
          ->check(CLI::IsMember({"graph", "paper"}))
          ->capture_default_str();
  verb->add_flag("--compare", arguments->side_by_side,
                 "Run both modes on the same input over loopback, into OUT/graph and OUT/paper, and compare them");
  verb->add_flag("--alone", arguments->compare.alone, "With --compare: also each robot by itself");
  verb->add_flag("--sets", arguments->compare.sets, "With --compare: also every smaller set of robots");
  verb->add_flag(
      "--ablation", arguments->compare.ablation,
      "With --compare: of all robots also the paper mode with each remedy (--fix) by itself, and with all remedies");
  verb->add_option(
      "--truth", arguments->truths,
      "With --compare: NAME=FILE, the truth of a robot (TUM format); else DIR/groundtruth.txt if there is");
  verb->add_option("--surface", arguments->compare.truth.surface, "With --compare: PLY of the true surface");
  std::vector<std::string> fixes;
  for (const PaperFix& fix : kPaperFixes) fixes.push_back(fix.name);
  verb->add_option("--fix", arguments->fixes,
                   "With --mode paper or --compare: a remedy for one of the method's known defects (joint-covariance: "
                   "a variation)")
      ->check(CLI::IsMember(fixes));
  verb->add_option("--device", arguments->options.device, "Vulkan device: auto, llvmpipe or a number")
      ->capture_default_str();
  verb->add_option("--domain", arguments->options.domain, "DDS domain; by default one by process id")
      ->check(CLI::Range(0, 230));
  verb->add_option("--keys", arguments->options.keys,
                   "Folder of a site's keys (fleet keys), with the core's and each robot's: all is encrypted");
  verb->add_option("--seeds", arguments->seeds,
                   "Run so many times, each with another book of place codes, into OUT/seed-1, OUT/seed-2 ...")
      ->check(CLI::Range(1, 1000));
  verb->add_flag("--realtime", arguments->options.realtime, "Play at the recorded speed (with --link dds)");
  verb->add_flag("--overwrite", arguments->overwrite,
                 "Replace an earlier run in the same folder; --compare and --seeds else go on with the same command's");
  verb->add_flag("--json", arguments->json, "Print report.json instead of the summary");
  verb->callback([arguments, link, mode, &exit_code] {
    arguments->link_given = link->count() > 0;
    arguments->mode_given = mode->count() > 0;
    if (arguments->mode == "paper" && !arguments->link_given) arguments->link = "loopback";
    exit_code = run(*arguments);
  });
}

}  // namespace comap
