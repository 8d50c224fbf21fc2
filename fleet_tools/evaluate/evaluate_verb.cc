#include <algorithm>
#include <cstdio>
#include <memory>
#include <thread>

#include "fleet_tools/command_line/fail.h"
#include "fleet_tools/command_line/text_table.h"
#include "fleet_tools/command_line/verb.h"
#include "fleet_tools/evaluate/evaluate.h"
#include "fleet_tools/evaluate/evaluate_table.h"
#include "fleet_tools/report/run_page.h"

namespace comap {
namespace {

struct EvaluateOptions {
  std::string trajectory, surface;
  std::vector<std::string> runs, truths;
  bool json = false;
};

void printRpe(const char* name, const std::optional<Rpe>& rpe) {
  if (!rpe) {
    std::printf("  %-9s none: no two frames that far apart\n", name);
  } else {
    std::printf("  %-9s %.4f m, %.3f deg (rmse of %zu)\n", name, rpe->translation_rmse_m, rpe->rotation_rmse_deg,
                rpe->pairs);
  }
}

int evaluateOne(const EvaluateOptions& options) {
  if (options.truths.size() != 1 || !options.surface.empty() || !options.runs.empty()) {
    return failWith({ErrorCode::kWrongUse, "--trajectory takes one --truth FILE, and neither RUN nor --surface"});
  }
  auto result = evaluateTrajectory(options.trajectory, options.truths.front());
  if (!result) return failWith(result.error());
  if (options.json) {
    std::printf("%s\n", toJson(*result).dump(2).c_str());
    return 0;
  }
  const Ate& ate = result->ate;
  std::printf("%s: %zu of %zu poses have truth\n", options.trajectory.c_str(), ate.pairs, result->poses);
  std::printf("  ATE       %.4f m rmse, %.4f mean, %.4f median, %.4f max (own alignment, no scale)\n", ate.rmse_m,
              ate.mean_m, ate.median_m, ate.max_m);
  printRpe("RPE frame", result->rpe_frame);
  printRpe("RPE 1 s", result->rpe_second);
  return 0;
}

std::string percent(const std::optional<double>& share) {
  return share ? fixed(100 * *share, 1) + " %" : std::string("none");
}

void printClosures(const ClosureScore& s) {
  std::printf("closures     between robots: precision %s (%zu of %zu); recall %s of %zu keyframes, %s of %zu pairs\n",
              percent(s.precision()).c_str(), s.right, s.accepted, percent(s.queryRecall()).c_str(), s.queries,
              percent(s.pairRecall()).c_str(), s.pairs);
  std::printf("merges       %zu, of them false %zu (%zu not taken back); first right one ", s.merges, s.false_merges,
              s.false_merges_standing);
  if (s.first_merge_s) {
    std::printf("after %.1f s, %u keyframes\n", *s.first_merge_s, s.first_merge_keyframes.value_or(0));
  } else {
    std::printf("none\n");
  }
}

void printRun(const RunEvaluation& evaluation) {
  std::printf("%-12s %10s %10s %10s %12s %8s  %s\n", "robot", "ATE own", "ATE joint", "RPE 1 s", "RPE 1 s", "poses",
              "map");
  std::printf("%-12s %10s %10s %10s %12s\n", "", "m rmse", "m rmse", "m", "deg");
  for (const auto& [name, robot] : evaluation.robots) {
    char joint[32] = "-", metres[32] = "-", degrees[32] = "-";
    if (robot.joint_rmse_m) std::snprintf(joint, sizeof joint, "%.4f", *robot.joint_rmse_m);
    if (robot.own.rpe_second) {
      std::snprintf(metres, sizeof metres, "%.4f", robot.own.rpe_second->translation_rmse_m);
      std::snprintf(degrees, sizeof degrees, "%.3f", robot.own.rpe_second->rotation_rmse_deg);
    }
    std::printf("%-12s %10.4f %10s %10s %12s %8zu  %s\n", name.c_str(), robot.own.ate.rmse_m, joint, metres, degrees,
                robot.own.ate.pairs, robot.map.c_str());
  }
  if (evaluation.joint) {
    std::printf("joint ATE    %.4f m rmse (one alignment for all robots)\n", evaluation.joint->rmse_m);
  } else {
    std::printf("joint ATE    none: %s\n", evaluation.joint_reason.c_str());
  }
  if (evaluation.surface) {
    const auto& s = *evaluation.surface;
    std::printf("surface      accuracy %.4f m mean, %.4f median, %.4f at 90 %%; completeness within 2 cm %.1f %%",
                s.accuracy_mean_m, s.accuracy_median_m, s.accuracy_p90_m, 100 * s.completeness_2cm);
    if (s.truth_points_seen > 0)
      std::printf(" (%.1f %% of what the keyframes saw, %.1f %% by discs)", 100 * s.completeness_seen_2cm,
                  100 * s.covered_seen_2cm);
    std::printf("\n");
  } else {
    std::printf("surface      none: %s\n", evaluation.surface_reason.c_str());
  }
  if (evaluation.doubles)
    std::printf("double walls %.2f %% of the map's surface lies 1 to 3 cm behind another\n",
                100 * evaluation.doubles->share());
  if (evaluation.closures) {
    printClosures(*evaluation.closures);
  } else {
    std::printf("closures     none: %s\n", evaluation.closures_reason.c_str());
  }
  if (evaluation.truth_fit) std::printf("%s", fitText(*evaluation.truth_fit).c_str());
}

int evaluateWhole(const EvaluateOptions& options) {
  RunTruth truth;
  truth.surface = options.surface;
  for (const auto& text : options.truths) {
    const size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == text.size()) {
      return failWith({ErrorCode::kWrongUse, "--truth " + text + ": expected NAME=FILE"});
    }
    if (!truth.trajectories.emplace(text.substr(0, equals), text.substr(equals + 1)).second) {
      return failWith({ErrorCode::kWrongUse, "--truth " + text + ": this robot's truth is given twice"});
    }
  }
  const int threads = static_cast<int>(std::clamp(std::thread::hardware_concurrency(), 1u, 64u));
  std::vector<std::string> runs;
  for (const std::string& given : options.runs) {
    const auto found = runsIn(given);
    if (!found) return failWith(found.error());
    runs.insert(runs.end(), found->begin(), found->end());
  }
  std::vector<RunNumbers> numbers;
  nlohmann::json reports;
  for (const std::string& run : runs) {
    auto evaluation = evaluateRun(run, truth, threads);
    if (!evaluation) return failWith(evaluation.error());
    auto report = updateReport(run, *evaluation);
    if (!report) return failWith(report.error());
    if (auto written = writeRunPage(run); !written) return failWith(written.error());
    numbers.push_back(numbersOf(*evaluation));
    reports[run] = *report;
    if (runs.size() == 1 && !options.json) printRun(*evaluation);
  }
  if (options.json && runs.size() == 1) {
    std::printf("%s\n", reports[runs.front()].dump(2).c_str());
  } else if (options.json) {
    const RunSummary summary = summarise(numbers);
    const nlohmann::json all = {
        {"runs", reports}, {"median", toJson(summary.median)}, {"worst", toJson(summary.worst)}};
    std::printf("%s\n", all.dump(2).c_str());
  } else if (runs.size() > 1) {
    std::printf("%s", tableOf(runs, numbers).c_str());
  }
  return 0;
}

}  // namespace

void addEvaluateVerb(CLI::App& app, int& exit_code) {
  auto* verb = app.add_subcommand("evaluate", "Measure a run, or one trajectory, against the truth");
  verb->footer(
      "Examples: fleet evaluate runs/flat --truth a=data/flat/a/groundtruth.txt --truth b=data/flat/b/groundtruth.txt\n"
      "              --surface data/flat/surface.ply\n"
      "          fleet evaluate --trajectory a.txt --truth data/flat/a/groundtruth.txt");
  auto options = std::make_shared<EvaluateOptions>();
  verb->add_option("RUN", options->runs,
                   "Folders that fleet replay wrote; report.json, report.html and errors.csv get the results. Several "
                   "(or one of replay "
                   "--seeds): a table with median and worst");
  verb->add_option("--truth", options->truths, "NAME=FILE for each robot, or FILE with --trajectory (TUM format)")
      ->required();
  verb->add_option("--trajectory", options->trajectory, "One trajectory in the TUM format, instead of RUN");
  verb->add_option("--surface", options->surface, "PLY of the true surface, in the frame of the truth");
  verb->add_flag("--json", options->json,
                 "Print JSON (for one RUN: the report as it is now; for several: runs, median, worst)");
  verb->callback([options, &exit_code] {
    if (options->runs.empty() && options->trajectory.empty()) {
      exit_code = failWith({ErrorCode::kWrongUse, "expected RUN or --trajectory FILE"});
      return;
    }
    exit_code = options->trajectory.empty() ? evaluateWhole(*options) : evaluateOne(*options);
  });
}

}  // namespace comap
