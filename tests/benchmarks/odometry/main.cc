// Speed, drift and memory of the robot's odometry on recorded sequences with truth, beside others on the same frames.
#include <CLI/CLI.hpp>
#include <cstdio>

#include "tests/benchmarks/odometry/clocks.h"
#include "tests/benchmarks/odometry/endurance.h"
#include "tests/benchmarks/odometry/peers.h"
#include "tests/benchmarks/odometry/race.h"
#include "tests/benchmarks/odometry/table.h"

namespace comap {
namespace {

constexpr double kMaxGrowth_percent = 5;

struct Arguments {
  std::vector<std::string> places;
  std::string config, json;
  bool verbose = false, no_peers = false, allocations = false;
  double minutes = 0;
  int threads = 1;
};

int failWith(const Error& error) {
  std::fprintf(stderr, "odometry_benchmark: %s\n", error.text.c_str());
  return exitCodeOf(error.code);
}

int compare(const Arguments& arguments, const AgentConfig& config) {
  BenchmarkRun run;
  run.one_core = arguments.threads == 1 && stayOnOneCore();
  run.processor = processorName();
  run.load_before = machineLoad();
  const bool peers = !arguments.no_peers && peersBuilt();
  if (!arguments.no_peers && !peersBuilt())
    std::fprintf(stderr, "CoMap alone: built without the others; -DCOMAP_BENCHMARK_PEERS=ON adds them\n");
  const auto methods = [&](const CameraModel& camera) {
    std::vector<std::unique_ptr<Method>> all;
    all.push_back(std::make_unique<OurOdometry>(config));
    if (arguments.threads > 1) {
      AgentConfig threaded = config;
      threaded.odometry.threads = arguments.threads;
      all.push_back(std::make_unique<OurOdometry>(threaded));
    }
    if (peers)
      for (auto& peer : makePeers(camera)) all.push_back(std::move(peer));
    return all;
  };
  const auto told = [&](size_t index, const Method& method, const Step& step) {
    if (arguments.verbose)
      std::printf("%4zu %-14s %6.1f ms %s %s\n", index, method.name().c_str(), step.cpu_ms,
                  step.state == TrackingState::kOk     ? "ok  "
                  : step.state == TrackingState::kPoor ? "poor"
                                                       : "lost",
                  step.note.c_str());
  };
  for (const std::string& place : arguments.places) {
    auto rows = race(place, methods, told);
    if (!rows) return failWith(rows.error());
    for (Row& row : *rows) run.rows.push_back(std::move(row));
  }
  run.load_after = machineLoad();
  std::printf("%s\n%s, %s, load %.1f before, %.1f after\n", tableOf(run.rows).c_str(), run.processor.c_str(),
              run.one_core ? "one core" : "not kept on one core", run.load_before, run.load_after);
  if (!arguments.json.empty())
    if (auto written = writeJson(run, arguments.json); !written) return failWith(written.error());
  return 0;
}

void printAllocations(const AllocationCounter& counter, bool places) {
  if (!canCountAllocations()) {
    std::printf("allocations: not counted in a build with a sanitizer\n");
    return;
  }
  for (const auto& [part, sum] : counter.sums())
    std::printf("allocations in %-8s %8.2f each time, worst %llu, %.0f bytes each time, %llu times\n", part.c_str(),
                static_cast<double>(sum.allocations) / static_cast<double>(sum.runs),
                static_cast<unsigned long long>(sum.worst),
                static_cast<double>(sum.bytes) / static_cast<double>(sum.runs),
                static_cast<unsigned long long>(sum.runs));
  if (!places) return;
  for (const AllocationCounter::Place& place : counter.places()) {
    std::printf("%10llu allocations, %12llu bytes, in %s:\n", static_cast<unsigned long long>(place.allocations),
                static_cast<unsigned long long>(place.bytes), place.part.c_str());
    for (const std::string& call : place.calls) std::printf("             %s\n", call.c_str());
  }
}

int watchMemory(const Arguments& arguments, const AgentConfig& config) {
  int worst = 0;
  for (const std::string& place : arguments.places) {
    AllocationCounter counter(arguments.allocations);
    std::printf("%s, %.1f minutes of sensor time\n", place.c_str(), arguments.minutes);
    const auto told = [](const EnduranceSample& sample) {
      std::printf("%8.2f min  %8zu frames  %8.2f MB\n", sample.minutes, sample.frames, sample.memory_mb);
      std::fflush(stdout);
    };
    const auto result = endure(place, config, arguments.minutes, counter, told);
    if (!result) return failWith(result.error());
    const bool grows = result->growth_percent() > kMaxGrowth_percent;
    std::printf("largest %.2f MB after %.2f min: %+.2f %% of the start (limit %.0f %%), %s; %.0f MB of frames apart\n",
                result->largest.memory_mb, result->largest.minutes, result->growth_percent(), kMaxGrowth_percent,
                grows ? "GROWS" : "steady", result->frames_mb);
    std::printf("keyframes %zu, poor %zu, lost %zu\n", result->keyframes, result->poor, result->lost);
    printAllocations(counter, arguments.allocations);
    worst = std::max(worst, grows ? 1 : 0);
  }
  return worst;
}

int run(const Arguments& arguments) {
  AgentConfig config;
  if (!arguments.config.empty()) {
    auto read = readAgentConfig(arguments.config);
    if (!read) return failWith(read.error());
    config = std::move(*read);
  }
  return arguments.minutes > 0 ? watchMemory(arguments, config) : compare(arguments, config);
}

}  // namespace
}  // namespace comap

int main(int argc, char** argv) {
  comap::Arguments arguments;
  CLI::App app("Speed and drift of the robot's odometry on recorded sequences, beside others on the same frames.",
               "odometry_benchmark");
  app.footer(
      "Examples: odometry_benchmark data/kitchen data/house@0:200 --json table.json\n"
      "          odometry_benchmark --config robot.yaml --no-peers -v data/kitchen\n"
      "          odometry_benchmark --minutes 30 data/kitchen@0:100      # memory; exit 1 if it grows\n"
      "          odometry_benchmark --minutes 1 --allocations data/kitchen@0:100\n"
      "Folders are in the TUM format and hold a groundtruth.txt. docs/evaluation.md says what the columns mean.\n"
      "Exit codes: 0 ok, 1 memory grows or too few true poses, 2 wrong use, 3 cannot read.");
  app.add_option("places", arguments.places, "DIR[@FIRST:LAST] ...")->required();
  app.add_option("--config", arguments.config, "The robot's YAML file (odometry and keyframes are used)");
  app.add_option("--json", arguments.json, "Write the rows to this file too");
  app.add_option("--minutes", arguments.minutes,
                 "Instead of comparing: play each sequence to and fro for so many minutes at 30 frames a second, as "
                 "fast as it goes, and watch memory")
      ->check(CLI::PositiveNumber);
  app.add_option("--threads", arguments.threads,
                 "Adds a row for the odometry on so many threads; all rows then run free of one core")
      ->check(CLI::Range(1, 64));
  app.add_flag("--allocations", arguments.allocations, "With --minutes: name the places that allocate (slow)");
  app.add_flag("--no-peers", arguments.no_peers, "CoMap alone");
  app.add_flag("-v,--verbose", arguments.verbose, "A line each frame");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  if (arguments.minutes > 0 && arguments.threads > 1) {
    std::fprintf(stderr, "odometry_benchmark: --threads goes with comparing, not with --minutes\n");
    return 2;
  }
  if (arguments.minutes > 0 && !arguments.json.empty()) {
    std::fprintf(stderr, "odometry_benchmark: --json goes with comparing, not with --minutes\n");
    return 2;
  }
  return comap::run(arguments);
}
