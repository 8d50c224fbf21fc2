#include "fleet_tools/replay/replay_compare.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <thread>

#include "edge_agent/capture/source_uri.h"
#include "fleet_tools/evaluate/compare.h"
#include "fleet_tools/replay/run_folder.h"
#include "fleet_tools/replay/run_outputs.h"
#include "protocol/types/whole_file.h"

namespace comap {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

// Where a recorded folder keeps its truth; empty if it has none.
std::string truthBeside(const std::string& source) {
  constexpr const char* kScheme = "tum:";
  const auto place = parseTumPlace(source.starts_with(kScheme) ? source.substr(4) : source);
  if (!place) return "";
  const std::string file = place->directory + "/groundtruth.txt";
  std::error_code none;
  return fs::exists(file, none) ? file : "";
}

RunTruth truthOf(const ReplayOptions& options, const CompareOptions& compare) {
  RunTruth truth;
  truth.surface = compare.truth.surface;
  for (const ReplayRobot& robot : options.robots) {
    const auto given = compare.truth.trajectories.find(robot.name);
    const std::string file = given != compare.truth.trajectories.end() ? given->second : truthBeside(robot.source);
    if (!file.empty()) truth.trajectories[robot.name] = file;
  }
  return truth;
}

// The report as it is after evaluation, if there is anything to evaluate with.
Result<json> evaluated(const ReplayOptions& options, const CompareOptions& compare, json report) {
  const RunTruth truth = truthOf(options, compare);
  if (truth.trajectories.empty()) return report;
  const int threads = static_cast<int>(std::clamp(std::thread::hardware_concurrency(), 1u, 64u));
  const auto evaluation = evaluateRun(options.out, truth, threads);
  if (!evaluation) return evaluation.error();
  return updateReport(options.out, *evaluation);
}

Result<ComparedInput> runBoth(const ReplayOptions& options, const PaperOptions& paper, const CompareOptions& compare,
                              const ReplayProgress& progress) {
  ComparedInput input;
  for (const ReplayRobot& robot : options.robots) input.name += (input.name.empty() ? "" : "+") + robot.name;
  const auto tell = [&](const char* mode) {
    return [&, mode](const std::string& stage, size_t done, size_t all) {
      progress(input.name + ", " + mode + " mode, " + stage, done, all);
    };
  };
  ReplayOptions one = options;
  one.out = options.out + "/graph";
  if (auto made = prepareRunFolder(one.out, false); !made) return made.error();
  const auto outcome = replayLoopback(one, tell("graph"));
  if (!outcome) return outcome.error();
  const auto graph = writeRunOutputs(one, *outcome);
  if (!graph) return graph.error();
  auto graph_numbers = evaluated(one, compare, *graph);
  if (!graph_numbers) return graph_numbers.error();
  input.graph = std::move(*graph_numbers);

  one.out = options.out + "/paper";
  if (auto made = prepareRunFolder(one.out, false); !made) return made.error();
  const auto published = replayPaper(one, paper, tell("paper"));
  if (!published) return published.error();
  auto paper_numbers = evaluated(one, compare, *published);
  if (!paper_numbers) return paper_numbers.error();
  input.paper = std::move(*paper_numbers);
  return input;
}

std::vector<ReportPicture> picturesOf(const std::string& out) {
  std::vector<ReportPicture> pictures;
  for (const auto& [file, title] :
       {std::pair("map.png", "map"), std::pair("map-contribution.png", "who contributed what")})
    for (const char* mode : {"graph", "paper"}) {
      std::ifstream stream(out + "/" + mode + "/" + file, std::ios::binary);
      std::vector<uint8_t> bytes((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
      if (!bytes.empty())
        pictures.push_back(
            {std::string(mode) + " mode: " + title, std::move(bytes), file != std::string_view("map.png")});
    }
  return pictures;
}

}  // namespace

Result<json> replayCompare(const ReplayOptions& options, const PaperOptions& paper, const CompareOptions& compare,
                           const ReplayProgress& progress) {
  for (const auto& [name, file] : compare.truth.trajectories)
    if (std::none_of(options.robots.begin(), options.robots.end(), [&](const auto& r) { return r.name == name; }))
      return Error{ErrorCode::kWrongUse, "--truth " + name + "=" + file + ": there is no robot " + name};
  std::vector<ComparedInput> inputs;
  if (compare.alone && options.robots.size() > 1) {
    for (const ReplayRobot& robot : options.robots) {
      ReplayOptions alone = options;
      alone.robots = {robot};
      alone.out = options.out + "/alone-" + robot.name;
      if (auto made = prepareRunFolder(alone.out, false); !made) return made.error();
      auto input = runBoth(alone, paper, compare, progress);
      if (!input) return input.error();
      inputs.push_back(std::move(*input));
    }
  }
  auto all = runBoth(options, paper, compare, progress);
  if (!all) return all.error();
  inputs.push_back(std::move(*all));

  const json comparison = compareJson(inputs);
  const auto times = readRoundTimes(options.out + "/paper/frames.csv");
  if (!times) return times.error();
  if (auto written = writeWholeFile(options.out + "/compare.json", comparison.dump(2) + "\n"); !written)
    return written.error();
  const std::string page = comparePage(comparison, picturesOf(options.out), *times);
  if (auto written = writeWholeFile(options.out + "/compare.html", page); !written) return written.error();
  return comparison;
}

}  // namespace comap
