#include "fleet_tools/replay/replay_arguments.h"

#include <algorithm>
#include <ctime>
#include <set>

#include "edge_agent/capture/source_uri.h"
#include "fleet_tools/replay/compare_truth.h"
#include "mapping_core/gpu/device_choice.h"
#include "mapping_core/surfels/seen_times.h"
#include "protocol/keys/credentials.h"

namespace comap {
namespace {

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

// Options that contradict each other.
Result<void> checkModes(ReplayArguments& arguments) {
  if (arguments.side_by_side) {
    if (arguments.seeds > 0) return Error{ErrorCode::kWrongUse, "--compare: takes no --seeds"};
    if (arguments.link_given && arguments.link != "loopback")
      return Error{ErrorCode::kWrongUse, "--compare: runs over --link loopback only"};
    if (arguments.mode_given) return Error{ErrorCode::kWrongUse, "--compare: runs both modes, takes no --mode"};
    arguments.link = "loopback";
    if (arguments.compare.ablation && !arguments.fixes.empty())
      return Error{ErrorCode::kWrongUse, "--ablation: chooses the remedies itself, takes no --fix"};
  } else if (arguments.compare.alone || arguments.compare.sets || arguments.compare.ablation ||
             !arguments.truths.empty() || !arguments.compare.truth.surface.empty()) {
    return Error{ErrorCode::kWrongUse, "--alone, --sets, --ablation, --truth, --surface: belong to --compare"};
  }
  if (!arguments.fixes.empty() && arguments.mode != "paper" && !arguments.side_by_side)
    return Error{ErrorCode::kWrongUse, "--fix: belongs to --mode paper"};
  if (arguments.mode == "paper" && arguments.link == "dds")
    return Error{ErrorCode::kWrongUse, "--mode paper: runs over --link loopback only"};
  if (arguments.options.realtime && arguments.link == "loopback")
    return Error{ErrorCode::kWrongUse, "--realtime: loopback has no clock; use --link dds"};
  if (!arguments.options.keys.empty() && arguments.link == "loopback")
    return Error{ErrorCode::kWrongUse, "--keys: loopback has no wire to encrypt; use --link dds"};
  if (const std::string problem = gpu::choiceProblem(arguments.options.device); !problem.empty())
    return Error{ErrorCode::kWrongUse, "--device: " + problem};
  return {};
}

// Before a folder is made: a wrong source is the most common mistake.
Result<void> checkSources(const std::vector<ReplayRobot>& robots) {
  for (const ReplayRobot& robot : robots) {
    if (robot.source.starts_with("klg:"))
      return Error{ErrorCode::kWrongUse,
                   "robot " + robot.name + ": " + robot.source +
                       ": a log does not tell its focal lengths; make a folder of it: edge_agent --config FILE " +
                       "--source " + robot.source + " --record DIR, with camera.colour in the configuration"};
    auto source = openSource(robot.source);
    if (!source) return Error{source.error().code, "robot " + robot.name + ": " + source.error().text};
    if ((*source)->live())
      return Error{ErrorCode::kWrongUse,
                   "robot " + robot.name + ": a camera cannot be replayed, record it first: " + "edge_agent --record"};
  }
  return {};
}

}  // namespace

void addReplayOptions(CLI::App& verb, ReplayArguments& arguments) {
  verb.add_option("--robot", arguments.robots,
                  "NAME=DIR[@FIRST:LAST], a TUM-format folder, or NAME=icl:DIR[@FIRST:LAST], an ICL-NUIM sequence; "
                  "once a robot")
      ->required();
  verb.add_option("--out", arguments.options.out, "Folder for the run")->required();
  verb.add_option("--link", arguments.link,
                  "dds: real processes, real DDS; loopback: one process, fixed order (--mode paper has only this)")
      ->check(CLI::IsMember({"loopback", "dds"}))
      ->capture_default_str();
  verb.add_option("--mode", arguments.mode,
                  "How the core maps: graph, or paper (the published method, every frame sent to the core)")
      ->check(CLI::IsMember({"graph", "paper"}))
      ->capture_default_str();
  verb.add_flag("--compare", arguments.side_by_side,
                "Run both modes on the same input over loopback, into OUT/graph and OUT/paper, and compare them");
  verb.add_flag("--alone", arguments.compare.alone, "With --compare: also each robot by itself");
  verb.add_flag("--sets", arguments.compare.sets, "With --compare: also every smaller set of robots");
  verb.add_flag(
      "--ablation", arguments.compare.ablation,
      "With --compare: of all robots also the paper mode with each remedy (--fix) by itself, and with all remedies");
  verb.add_option("--truth", arguments.truths,
                  "With --compare: NAME=FILE, the truth of a robot (TUM format); else DIR/groundtruth.txt if there is");
  verb.add_option("--surface", arguments.compare.truth.surface, "With --compare: PLY of the true surface");
  std::vector<std::string> fixes;
  for (const PaperFix& fix : kPaperFixes) fixes.push_back(fix.name);
  verb.add_option("--fix", arguments.fixes,
                  "With --mode paper or --compare: a remedy for one of the method's known defects (joint-covariance: "
                  "a variation)")
      ->check(CLI::IsMember(fixes));
  verb.add_option("--device", arguments.options.device,
                  "Vulkan device: auto, llvmpipe or a number of mapping_core --list-devices")
      ->capture_default_str();
  verb.add_option("--domain", arguments.options.domain, "DDS domain; by default one by process id")
      ->check(CLI::Range(0, 230));
  verb.add_option("--keys", arguments.options.keys,
                  "Folder of a site's keys (fleet keys), with the core's and each robot's: all is encrypted");
  verb.add_option("--seeds", arguments.seeds,
                  "Run so many times, each with another book of place codes, into OUT/seed-1, OUT/seed-2 ...")
      ->check(CLI::Range(1, 1000));
  verb.add_flag("--realtime", arguments.options.realtime, "Play at the recorded speed (with --link dds)");
  verb.add_flag(
      "--overwrite", arguments.overwrite,
      "Replace an earlier run in the same folder; without it, --compare and --seeds that were interrupted go on "
      "with the same command");
  verb.add_flag("--json", arguments.json, "Print report.json instead of the summary");
}

Result<void> checkReplay(ReplayArguments& arguments) {
  if (auto fit = checkModes(arguments); !fit) return fit;
  auto robots = parseRobots(arguments.robots);
  if (!robots) return robots.error();
  for (const PaperFix& fix : kPaperFixes)
    arguments.paper.fixes.*fix.chosen = std::ranges::count(arguments.fixes, fix.name) > 0;
  arguments.options.robots = std::move(*robots);
  if (auto checked = checkSources(arguments.options.robots); !checked) return checked;
  if (arguments.side_by_side) {
    auto truths = parseTruths(arguments.truths);
    if (!truths) return truths.error();
    arguments.compare.truth.trajectories = std::move(*truths);
    if (auto checked = checkCompare(arguments.options.robots, arguments.compare.truth); !checked) return checked;
  }
  if (arguments.mode == "paper" && arguments.options.robots.size() > kMostCameras)
    return Error{ErrorCode::kWrongUse, "--mode paper: " + std::to_string(arguments.options.robots.size()) +
                                           " robots, expected at most " + std::to_string(kMostCameras)};
  return checkKeysFor(arguments.options);
}

}  // namespace comap
