// Speed and accuracy of the keyframe graph and of the fern index on synthetic buildings:
//   graph_benchmark [--keyframes N ...] [--closures K] [--seed S] [--skip-ferns] [--grow]
// Times are of the processor, one thread, so that a busy machine does not change them much.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <random>
#include <vector>

#include "mapping_core/ferns/place_index.h"
#include "mapping_core/graph/graph_solver.h"
#include "tests/benchmarks/command_line.h"
#include "tests/scenes/building_graph.h"

namespace comap {
namespace {

double cpuSeconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

struct Times {
  double median = 0, p95 = 0, worst = 0;
};
Times timesOf(std::vector<double> seconds) {
  std::sort(seconds.begin(), seconds.end());
  if (seconds.empty()) return {};
  return {seconds[seconds.size() / 2], seconds[seconds.size() * 95 / 100], seconds.back()};
}

class GrownGraph {
 public:
  GrownGraph(const BuildingGraph& building, bool with_false) : building_(building), with_false_(with_false) {}

  bool add(size_t number, bool at_truth) {
    const auto& keyframe = building_.keyframes[number];
    const bool first = keyframe.id.sequence == 0;
    const Pose T =
        first || at_truth ? keyframe.T_map_cam : solver_.pose(keyframe.edges[0].from) * keyframe.edges[0].T_from_to;
    bool good = bool(solver_.addKeyframe(keyframe.id, T, first ? std::nullopt : std::optional(keyframe.edges[0].from)));
    for (size_t i = 0; i < keyframe.edges.size(); ++i)
      if (with_false_ || !keyframe.edge_false[i]) good = good && bool(solver_.addEdge(keyframe.edges[i]));
    return good;
  }
  GraphSolver& solver() { return solver_; }

  void printState(const char* name) const {
    double sum = 0, worst = 0;
    size_t all_false = 0, false_used = 0, all_true = 0, true_rejected = 0;
    for (const auto& keyframe : building_.keyframes) {
      const double d = (solver_.pose(keyframe.id).translation() - keyframe.T_map_cam.translation()).norm();
      sum += d * d;
      worst = std::max(worst, d);
      for (size_t i = 0; i < keyframe.edges.size(); ++i) {
        if (keyframe.edges[i].kind == EdgeKind::kOdometry || (keyframe.edge_false[i] && !with_false_)) continue;
        const bool used = solver_.uses(keyOf(keyframe.edges[i]));
        all_false += keyframe.edge_false[i];
        false_used += keyframe.edge_false[i] && used;
        all_true += !keyframe.edge_false[i];
        true_rejected += !keyframe.edge_false[i] && !used;
      }
    }
    std::printf("  %-26s error %.4f m rmse, %.4f worst; false edges used %zu of %zu; true edges rejected %zu of %zu\n",
                name, std::sqrt(sum / static_cast<double>(building_.keyframes.size())), worst, false_used, all_false,
                true_rejected, all_true);
  }

 private:
  const BuildingGraph& building_;
  bool with_false_;
  GraphSolver solver_;
};

struct Arguments {
  std::vector<int> keyframes = {1000, 10000};
  int closures = 100;
  unsigned seed = 1;
  bool skip_ferns = false, skip_graph = false, grow = false;
};

void printTimes(const char* name, const Times& t, size_t count) {
  std::printf("  %-26s median %.3f s, 95 %% %.3f s, worst %.3f s (of %zu)\n", name, t.median, t.p95, t.worst, count);
}

// The graph is there, at rest; the last keyframes come one by one with their closures. --grow: all of them do.
bool benchmarkGraph(const Arguments& arguments, int keyframes, double false_share, bool pairs, bool with_false) {
  BuildingOptions options;
  options.keyframes = keyframes;
  options.covisible = 5;
  options.closures = 6;
  options.false_share = false_share;
  options.false_in_pairs = pairs;
  options.seed = arguments.seed;
  const BuildingGraph building = makeBuildingGraph(options);
  std::printf("%d keyframes, %zu edges, %d robots, %s\n", keyframes,
              building.edges - (with_false ? 0 : building.false_edges), options.robots,
              !with_false        ? "the same without its false closures"
              : false_share == 0 ? "no false closures"
              : pairs            ? "20 % of closures false, in pairs that agree"
                                 : "20 % of closures false");
  GrownGraph grown(building, with_false);
  const size_t count = building.keyframes.size();
  const size_t live = arguments.grow ? count : std::min(count / 2, static_cast<size_t>(arguments.closures));
  std::vector<double> seconds;
  size_t unsettled = 0;
  int most_rounds = 0;
  double start = cpuSeconds();
  for (size_t i = 0; i < count; ++i) {
    if (!grown.add(i, i < count - live)) return false;
    if (i + 1 < count - live) continue;
    const double before = cpuSeconds();
    if (i + 1 == count - live) {
      if (!grown.solver().solveFully()) return false;
      std::printf("  %-26s %.1f s (from the truth: what noise in the edges makes of it)\n", "whole graph",
                  cpuSeconds() - start);
      continue;
    }
    const auto update = grown.solver().solve();
    if (!update) return false;
    unsettled += !update->settled;
    most_rounds = std::max(most_rounds, update->rounds);
    seconds.push_back(cpuSeconds() - before);
  }
  printTimes("one new keyframe", timesOf(seconds), seconds.size());
  std::printf("  %-26s %d rounds at most; %zu calls left something to the next one\n", "", most_rounds, unsettled);
  grown.printState("after the last");
  start = cpuSeconds();
  const auto whole = grown.solver().solveFully();
  if (!whole) return false;
  std::printf(
      "  %-26s %.1f s, %d rounds, %d iterations; scales odometry %.2f loop %.2f inter-robot %.2f covisibility %.2f\n",
      "whole graph again", cpuSeconds() - start, whole->rounds, whole->iterations, whole->scale[0], whole->scale[1],
      whole->scale[2], whole->scale[3]);
  grown.printState("after that");
  return true;
}

// From odometry alone, by graduated non-convexity over all closures at once.
bool benchmarkBatch(int keyframes, unsigned seed) {
  BuildingOptions options;
  options.keyframes = keyframes;
  options.false_share = 0.2;
  options.closures = 0.3;
  options.covisible = 2;
  options.seed = seed;
  const BuildingGraph building = makeBuildingGraph(options);
  std::map<KeyframeId, Pose> initial;
  std::vector<Edge> edges;
  std::vector<bool> wrong;
  for (const auto& keyframe : building.keyframes) {
    initial[keyframe.id] = keyframe.T_map_odometry;
    for (size_t i = 0; i < keyframe.edges.size(); ++i) {
      edges.push_back(keyframe.edges[i]);
      wrong.push_back(keyframe.edge_false[i]);
    }
  }
  const double start = cpuSeconds();
  const auto solution = optimiseGraph(initial, edges, building.keyframes[0].id);
  if (!solution) return false;
  size_t used = 0;
  for (size_t i = 0; i < edges.size(); ++i) used += wrong[i] && solution->edge_weight[i] > 0;
  double sum = 0;
  for (const auto& keyframe : building.keyframes)
    sum += (solution->T_map_cam.at(keyframe.id).translation() - keyframe.T_map_cam.translation()).squaredNorm();
  std::printf(
      "%d keyframes, %zu edges from odometry, batch: %.1f s, %d iterations, error %.4f m rmse, false edges used %zu of "
      "%zu\n",
      keyframes, edges.size(), cpuSeconds() - start, solution->iterations, std::sqrt(sum / keyframes), used,
      building.false_edges);
  return true;
}

// Codes of places: neighbours in a walk share most of their ferns, as pictures of one room do.
void benchmarkFerns(int places, unsigned seed) {
  std::mt19937 engine(seed);
  const auto below = [&](uint32_t n) { return engine() % n; };
  PlaceIndex index;
  FernCode code{1, std::vector<uint8_t>(500)};
  for (uint8_t& c : code.codes) c = static_cast<uint8_t>(below(16));
  std::vector<FernCode> queries;
  for (int i = 0; i < places; ++i) {
    for (int k = 0; k < 100; ++k)
      code.codes[below(500)] = below(5) == 0 ? FernCode::kBad : static_cast<uint8_t>(below(16));
    index.add(static_cast<uint32_t>(i), code);
    if (i % (places / 100) == 0) queries.push_back(code);
  }
  std::vector<double> seconds;
  for (FernCode& query : queries) {
    for (int k = 0; k < 60; ++k) query.codes[below(500)] = static_cast<uint8_t>(below(16));
    const double start = cpuSeconds();
    const auto found = index.query(query, 5, [](uint32_t place) { return place % 7 != 0; });
    seconds.push_back(cpuSeconds() - start);
    if (found.empty()) std::printf("  nothing found\n");
  }
  const Times t = timesOf(seconds);
  std::printf("ferns, %d places: query median %.2f ms, 95 %% %.2f ms, worst %.2f ms\n", places, 1e3 * t.median,
              1e3 * t.p95, 1e3 * t.worst);
}

bool run(const Arguments& arguments) {
  for (const int keyframes : arguments.keyframes) {
    if (!arguments.skip_ferns) benchmarkFerns(keyframes, arguments.seed);
    if (arguments.skip_graph) continue;
    if (keyframes <= 2000 && !benchmarkBatch(keyframes, arguments.seed)) return false;
    for (const bool pairs : {false, true}) {
      if (!pairs && !benchmarkGraph(arguments, keyframes, 0, false, true)) return false;
      if (!benchmarkGraph(arguments, keyframes, 0.2, pairs, true)) return false;
      if (!benchmarkGraph(arguments, keyframes, 0.2, pairs, false)) return false;
    }
  }
  return true;
}

}  // namespace
}  // namespace comap

int main(int argc, char** argv) {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);  // what is known so far is not lost if the run is ended
  CLI::App app("Measures the keyframe graph and the fern index on synthetic buildings");
  comap::Arguments arguments;
  app.add_option("--keyframes", arguments.keyframes, "Sizes")->check(CLI::Range(200, 200000))->capture_default_str();
  app.add_option("--closures", arguments.closures, "Keyframes added and timed at the end")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  app.add_option("--seed", arguments.seed, "Of the building")->capture_default_str();
  app.add_flag("--skip-ferns", arguments.skip_ferns, "Only the graph");
  app.add_flag("--skip-graph", arguments.skip_graph, "Only the ferns");
  app.add_flag("--grow", arguments.grow, "Add every keyframe one by one, not only the last");
  if (const auto code = comap::endOfParsing(app, argc, argv)) return *code;
  if (comap::run(arguments)) return 0;
  std::fprintf(stderr, "graph_benchmark: a graph was not solved\n");
  return 1;
}
