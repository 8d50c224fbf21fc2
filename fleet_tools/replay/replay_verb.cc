#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <memory>
#include <set>

#include "edge_agent/capture/source_uri.h"
#include "fleet_tools/command_line/fail.h"
#include "fleet_tools/command_line/verb.h"
#include "fleet_tools/evaluate/compare.h"
#include "fleet_tools/replay/replay.h"
#include "fleet_tools/replay/replay_compare.h"
#include "fleet_tools/replay/run_folder.h"
#include "fleet_tools/replay/run_outputs.h"
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
void tellWhenInterrupted(const std::string& out) {
  interrupted_text =
      "fleet: interrupted: the run in " + out + " is not complete; the same command with --overwrite begins it anew\n";
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
  bool side_by_side = false;
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

// What of the robot's frames was not as it should be; empty if all was well.
std::string troubleText(const nlohmann::json& robot) {
  std::string text;
  const auto tell = [&](const char* key, const char* what) {
    const int count = robot.at(key).get<int>();
    if (count > 0) text += (text.empty() ? "" : ", ") + std::to_string(count) + what;
  };
  tell("damaged_frames", " damaged and passed over");
  tell("tracking_poor_frames", " tracked poorly");
  tell("tracking_lost_frames", " lost");
  tell("relocalised", " found back");
  return text.empty() ? text : " (" + text + ")";
}

std::string listText(const nlohmann::json& names) {
  std::string text;
  for (const auto& name : names) text += (text.empty() ? "" : ", ") + name.get<std::string>();
  return text;
}

// "42 refused (31 inlier_ratio, 11 coarse_alignment)", or "none refused".
std::string refusedText(const nlohmann::json& refused) {
  std::vector<std::pair<int, std::string>> reasons;
  int sum = 0;
  for (const auto& [reason, count] : refused.items()) {
    reasons.emplace_back(count.get<int>(), reason);
    sum += count.get<int>();
  }
  if (sum == 0) return "none refused";
  std::stable_sort(reasons.begin(), reasons.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::string text;
  for (const auto& [count, reason] : reasons) text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + reason;
  return std::to_string(sum) + " refused (" + text + ")";
}

std::string countOf(const nlohmann::json& object, const char* key, const char* noun) {
  return counted(object.at(key).get<size_t>(), noun);
}

void printSummary(const nlohmann::json& report, const std::string& out) {
  for (const auto& [name, robot] : report.at("robots").items())
    std::printf("robot %-8s %s%s, %s (%d lost), %.0f kB/s up, odometry %.1f ms (p95 %.1f), map %s, holds %s of it\n",
                name.c_str(), countOf(robot, "frames", "frame").c_str(), troubleText(robot).c_str(),
                countOf(robot, "keyframes", "keyframe").c_str(), robot.at("keyframes_lost").get<int>(),
                robot.at("uplink_bytes_per_s").get<double>() / 1000, robot.at("odometry_ms").at("median").get<double>(),
                robot.at("odometry_ms").at("p95").get<double>(), robot.at("map").get<std::string>().c_str(),
                countOf(robot, "tiles_held", "tile").c_str());
  for (const auto& map : report.at("maps"))
    std::printf("map %s: %s %s, %s, %s, %s\n", map.at("id").get<std::string>().c_str(),
                wordFor(map.at("robots").size(), "robot", "robots"), listText(map.at("robots")).c_str(),
                countOf(map, "keyframes", "keyframe").c_str(), countOf(map, "surfels", "surfel").c_str(),
                countOf(map, "tiles", "tile").c_str());
  std::printf("place matches: %d accepted, %s\n", report.at("verdicts").at("accepted").get<int>(),
              refusedText(report.at("verdicts").at("refused")).c_str());
  std::printf("core: %.0f ms a keyframe (p95 %.0f) on %s; %.1f s in all\n",
              report.at("core").at("keyframe_ms").at("median").get<double>(),
              report.at("core").at("keyframe_ms").at("p95").get<double>(),
              report.at("core").at("device").get<std::string>().c_str(), report.at("wall_s").get<double>());
  std::printf("run: %s (map.comap, map.ply, *.trajectory.txt, report.json, report.html)\n", out.c_str());
}

void printPaperSummary(const nlohmann::json& report, const std::string& out) {
  for (const auto& [name, robot] : report.at("robots").items())
    std::printf("robot %-8s %s (%d lost), %.0f kB/s up, map %s\n", name.c_str(),
                countOf(robot, "frames", "frame").c_str(), robot.at("tracking_lost_frames").get<int>(),
                robot.at("uplink_bytes_per_s").get<double>() / 1000, robot.at("map").get<std::string>().c_str());
  for (const auto& map : report.at("maps"))
    std::printf("map %s: %s %s, %s, %s\n", map.at("id").get<std::string>().c_str(),
                wordFor(map.at("robots").size(), "robot", "robots"), listText(map.at("robots")).c_str(),
                countOf(map, "surfels", "surfel").c_str(), countOf(map, "places", "place").c_str());
  const auto& core = report.at("core");
  std::printf("loops: %d local, %d global; merges: %zu\n", core.at("local_loops").get<int>(),
              core.at("global_loops").get<int>(), report.at("merges").size());
  std::printf("core: %.0f ms a frame and camera (p95 %.0f) on %s; %.1f s in all\n",
              core.at("frame_ms").at("median").get<double>(), core.at("frame_ms").at("p95").get<double>(),
              core.at("device").get<std::string>().c_str(), report.at("wall_s").get<double>());
  std::printf("run: %s (map.ply, *.trajectory.txt, frames.csv, report.json, report.html)\n", out.c_str());
}

size_t framesOf(const nlohmann::json& robot) {
  return robot.at("frames").get<size_t>() + robot.at("damaged_frames").get<size_t>();
}

// The run's files are there, but they do not show what was asked for.
int failIfIncomplete(const nlohmann::json& report) {
  for (const auto& [name, robot] : report.at("robots").items()) {
    if (robot.at("keyframes_lost").get<int>() > 0)
      return failWith({ErrorCode::kProblem, "robot " + name + ": " +
                                                counted(robot.at("keyframes_lost").get<size_t>(), "keyframe") +
                                                " did not reach the core"});
    if (robot.at("keyframes").get<int>() == 0)
      return failWith({ErrorCode::kBadData, "robot " + name + ": of " + counted(framesOf(robot), "frame") +
                                                " none can be used, " + robot.at("damaged_frames").dump() +
                                                " damaged and the others with too little depth to start from"});
  }
  return 0;
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
    printSummary(*report, arguments.options.out);
  return failIfIncomplete(*report);
}

// A run a seed in seed-1, seed-2 ...; the first book is the standard one. The exit code is the worst one.
int runSeeds(const ReplayArguments& arguments) {
  int worst = 0;
  for (int seed = 0; seed < arguments.seeds; ++seed) {
    ReplayArguments one = arguments;
    one.options.out += "/seed-" + std::to_string(seed + 1);
    one.options.fern_seed += static_cast<uint32_t>(seed);
    if (auto prepared = prepareRunFolder(one.options.out, false); !prepared) return failWith(prepared.error());
    worst = std::max(worst, runOnce(one));
  }
  return worst;
}

int runCompare(ReplayArguments& arguments) {
  for (const std::string& text : arguments.truths) {
    const size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == text.size())
      return failWith({ErrorCode::kWrongUse, "--truth " + text + ": expected NAME=FILE"});
    arguments.compare.truth.trajectories[text.substr(0, equals)] = text.substr(equals + 1);
  }
  const ProgressLine progress;
  const auto comparison = replayCompare(arguments.options, arguments.paper, arguments.compare, progress.writer());
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
  if (auto checked = checkKeysFor(arguments.options); !checked) return failWith(checked.error());
  if (auto prepared = prepareRunFolder(arguments.options.out, arguments.overwrite); !prepared)
    return failWith(prepared.error());
  tellWhenInterrupted(arguments.options.out);
  if (arguments.side_by_side) return runCompare(arguments);
  return arguments.seeds == 0 ? runOnce(arguments) : runSeeds(arguments);
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
  verb->add_option("--mode", arguments->mode,
                   "How the core maps: graph, or paper (the published method, every frame sent to the core)")
      ->check(CLI::IsMember({"graph", "paper"}))
      ->capture_default_str();
  verb->add_flag("--compare", arguments->side_by_side,
                 "Run both modes on the same input over loopback, into OUT/graph and OUT/paper, and compare them");
  verb->add_flag("--alone", arguments->compare.alone, "With --compare: also each robot by itself");
  verb->add_flag("--sets", arguments->compare.sets, "With --compare: also every smaller set of robots");
  verb->add_flag("--ablation", arguments->compare.ablation,
                 "With --compare: of all robots also the paper mode with each remedy (--fix) by itself, and with all");
  verb->add_option(
      "--truth", arguments->truths,
      "With --compare: NAME=FILE, the truth of a robot (TUM format); else DIR/groundtruth.txt if there is");
  verb->add_option("--surface", arguments->compare.truth.surface, "With --compare: PLY of the true surface");
  std::vector<std::string> fixes;
  for (const PaperFix& fix : kPaperFixes) fixes.push_back(fix.name);
  verb->add_option("--fix", arguments->fixes, "With --mode paper: a remedy for one of the method's known defects")
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
  verb->add_flag("--overwrite", arguments->overwrite, "Replace an earlier run in the same folder");
  verb->add_flag("--json", arguments->json, "Print report.json instead of the summary");
  verb->callback([arguments, link, &exit_code] {
    if (arguments->mode == "paper" && link->count() == 0) arguments->link = "loopback";
    exit_code = run(*arguments);
  });
}

}  // namespace comap
