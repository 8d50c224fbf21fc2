#include "fleet_tools/replay/replay_compare.h"

#include <algorithm>
#include <functional>
#include <thread>

#include "fleet_tools/evaluate/compare.h"
#include "fleet_tools/evaluate/evaluate.h"
#include "fleet_tools/replay/compare_truth.h"
#include "fleet_tools/replay/run_outputs.h"
#include "fleet_tools/report/compare_page.h"
#include "fleet_tools/report/map_pictures.h"
#include "fleet_tools/report/run_page.h"
#include "protocol/types/whole_file.h"

namespace comap {
namespace {

using nlohmann::json;

// The report as it is after evaluation, if there is anything to evaluate with.
Result<json> evaluated(const ReplayOptions& options, const CompareOptions& compare, json report) {
  const RunTruth truth = truthOf(options.robots, compare.truth);
  if (truth.trajectories.empty()) return report;
  const int threads = static_cast<int>(std::clamp(std::thread::hardware_concurrency(), 1u, 64u));
  const auto evaluation = evaluateRun(options.out, truth, threads);
  if (!evaluation) return evaluation.error();
  auto updated = updateReport(options.out, *evaluation);
  if (!updated) return updated.error();
  if (auto written = writeRunPage(options.out); !written) return written.error();
  return updated;
}

std::string nameOf(const std::vector<ReplayRobot>& robots) {
  std::string name;
  for (const ReplayRobot& robot : robots) name += (name.empty() ? "" : "+") + robot.name;
  return name;
}

ReplayProgress tellWith(const ReplayProgress& progress, const std::string& what) {
  return [&progress, what](const std::string& stage, size_t done, size_t all) {
    progress(what + ", " + stage, done, all);
  };
}

// A run into options.out, evaluated; one that was finished before is read.
Result<json> runOne(const ReplayOptions& options, const CompareOptions& compare, RunSeries& series,
                    const std::function<Result<json>()>& play) {
  const auto finished = series.takeUp(options.out);
  if (!finished) return finished.error();
  if (*finished) return readReport(options.out);
  const auto report = play();
  if (!report) return report;
  auto measured = evaluated(options, compare, *report);
  if (!measured) return measured;
  if (auto noted = series.finish(options.out, 0); !noted) return noted.error();
  return measured;
}

Result<json> runGraph(const ReplayOptions& options, const CompareOptions& compare, RunSeries& series,
                      const ReplayProgress& progress) {
  return runOne(options, compare, series, [&]() -> Result<json> {
    const auto outcome = replayLoopback(options, tellWith(progress, nameOf(options.robots) + ", graph mode"));
    if (!outcome) return outcome.error();
    return writeRunOutputs(options, *outcome);
  });
}

Result<json> runPaper(const ReplayOptions& options, const PaperOptions& paper, const CompareOptions& compare,
                      RunSeries& series, const ReplayProgress& progress, const std::string& what) {
  return runOne(options, compare, series,
                [&] { return replayPaper(options, paper, tellWith(progress, nameOf(options.robots) + ", " + what)); });
}

Result<ComparedInput> runBoth(const ReplayOptions& options, const PaperOptions& paper, const CompareOptions& compare,
                              RunSeries& series, const ReplayProgress& progress) {
  ComparedInput input;
  input.name = nameOf(options.robots);
  ReplayOptions one = options;
  one.out = options.out + "/graph";
  auto graph = runGraph(one, compare, series, progress);
  if (!graph) return graph.error();
  input.graph = std::move(*graph);
  one.out = options.out + "/paper";
  auto published = runPaper(one, paper, compare, series, progress, "paper mode");
  if (!published) return published.error();
  input.paper = std::move(*published);
  return input;
}

// The paper mode with each remedy by itself, then with all; variations that are none have only rows of their own.
Result<void> runRemedies(const ReplayOptions& options, const PaperOptions& paper, const CompareOptions& compare,
                         RunSeries& series, const ReplayProgress& progress, ComparedInput& input) {
  const auto run = [&](const std::string& name, const PaperFixes& fixes) -> Result<void> {
    ReplayOptions one = options;
    one.out = options.out + "/fix-" + name;
    PaperOptions fixed_paper = paper;
    fixed_paper.fixes = fixes;
    auto report = runPaper(one, fixed_paper, compare, series, progress, name);
    if (!report) return report.error();
    input.remedies.emplace_back(name, std::move(*report));
    return {};
  };
  PaperFixes all;
  for (const PaperFix& fix : kPaperFixes) {
    PaperFixes only;
    only.*fix.chosen = true;
    all.*fix.chosen = fix.remedy;
    if (auto done = run(fix.name, only); !done) return done;
  }
  return run("all", all);
}

// Smaller sets of robots than all, smallest first; only single ones unless `sets`.
std::vector<std::vector<ReplayRobot>> smallerSets(const std::vector<ReplayRobot>& robots, bool sets) {
  std::vector<std::vector<ReplayRobot>> found;
  for (size_t size = 1; size < (sets ? robots.size() : std::min<size_t>(2, robots.size())); ++size) {
    std::vector<bool> chosen(robots.size());
    std::fill_n(chosen.begin(), size, true);
    do {
      std::vector<ReplayRobot>& set = found.emplace_back();
      for (size_t i = 0; i < robots.size(); ++i)
        if (chosen[i]) set.push_back(robots[i]);
    } while (std::prev_permutation(chosen.begin(), chosen.end()));
  }
  return found;
}

// Whose map a mode's pictures show, if there are several.
std::string pictured(const json& report) {
  const json& maps = report.at("maps");
  if (maps.size() < 2) return "";
  const auto largest = std::max_element(maps.begin(), maps.end(), [](const json& a, const json& b) {
    return a.at("surfels").get<double>() < b.at("surfels").get<double>();
  });
  std::string robots;
  for (const json& robot : largest->at("robots")) robots += (robots.empty() ? "" : ", ") + robot.get<std::string>();
  return ", largest of " + std::to_string(maps.size()) +
         " maps: " + (largest->at("robots").size() == 1 ? "robot " : "robots ") + robots;
}

// Each picture of the graph mode with the same one of the paper mode.
Result<std::vector<ReportPicture>> picturesOf(const std::string& out) {
  std::vector<std::vector<ReportPicture>> of_modes;
  for (const std::string mode : {"graph", "paper"}) {
    auto pictures = readMapPictures(out + "/" + mode);
    if (!pictures) return pictures.error();
    const auto report = readReport(out + "/" + mode);
    if (!report) return report.error();
    for (ReportPicture& picture : *pictures) {
      picture.title = mode + " mode: " + picture.title + pictured(*report);
      picture.colours = robotColours(*report);
    }
    of_modes.push_back(std::move(*pictures));
  }
  std::vector<ReportPicture> pictures;
  for (size_t i = 0; i < std::max(of_modes[0].size(), of_modes[1].size()); ++i)
    for (auto& of_mode : of_modes)
      if (i < of_mode.size()) pictures.push_back(std::move(of_mode[i]));
  return pictures;
}

}  // namespace

size_t runsOf(const std::vector<ReplayRobot>& robots, const CompareOptions& compare) {
  const size_t sets = 1 + (compare.alone || compare.sets ? smallerSets(robots, compare.sets).size() : 0);
  return 2 * sets + (compare.ablation ? std::size(kPaperFixes) + 1 : 0);
}

Result<json> replayCompare(const ReplayOptions& options, const PaperOptions& paper, const CompareOptions& compare,
                           RunSeries& series, const ReplayProgress& progress) {
  std::vector<ComparedInput> inputs;
  if (compare.alone || compare.sets) {
    for (const std::vector<ReplayRobot>& set : smallerSets(options.robots, compare.sets)) {
      ReplayOptions fewer = options;
      fewer.robots = set;
      fewer.out = options.out + (set.size() == 1 ? "/alone-" : "/set-") + nameOf(set);
      if (auto made = series.addFolder(fewer.out); !made) return made.error();
      auto input = runBoth(fewer, paper, compare, series, progress);
      if (!input) return input.error();
      inputs.push_back(std::move(*input));
    }
  }
  auto all = runBoth(options, paper, compare, series, progress);
  if (!all) return all.error();
  if (compare.ablation) {
    if (auto done = runRemedies(options, paper, compare, series, progress, *all); !done) return done.error();
  }
  inputs.push_back(std::move(*all));

  const json comparison = compareJson(inputs);
  const auto times = readRoundTimes(options.out + "/paper/frames.csv");
  if (!times) return times.error();
  if (auto written = writeWholeFile(options.out + "/compare.json", comparison.dump(2) + "\n"); !written)
    return written.error();
  const auto pictures = picturesOf(options.out);
  if (!pictures) return pictures.error();
  if (auto written = writeWholeFile(options.out + "/compare.html", comparePage(comparison, *pictures, *times));
      !written)
    return written.error();
  return comparison;
}

}  // namespace comap
