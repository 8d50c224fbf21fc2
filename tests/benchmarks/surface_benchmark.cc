// Surface quality of fusion alone: recorded sequences fused at their true poses, against the true surface.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <thread>

#include "edge_agent/capture/source_uri.h"
#include "fleet_tools/evaluate/metrics_doubles.h"
#include "fleet_tools/evaluate/metrics_surface.h"
#include "fleet_tools/evaluate/metrics_trajectory.h"
#include "fleet_tools/evaluate/surface_seen.h"
#include "mapping_core/surfels/surfel_map.h"
#include "tests/benchmarks/command_line.h"

namespace comap {
namespace {

struct Options {
  std::vector<std::string> sequences;
  std::string surface, ply, device = "auto";
  int every = 8;
  int rounds = 1;
  float sure = FusionParameters().stable_confidence;
};

struct View {
  Frame frame;
  Pose T_world_cam;
  uint32_t robot = 0;
};

int fail(const Error& error) {
  std::fprintf(stderr, "%s\n", error.text.c_str());
  return exitCodeOf(error.code);
}

Result<std::vector<View>> load(const Options& options) {
  std::vector<View> views;
  for (size_t robot = 0; robot < options.sequences.size(); ++robot) {
    auto source = openSource(options.sequences[robot]);
    if (!source) return source.error();
    const auto truth =
        readTrajectory(options.sequences[robot].substr(0, options.sequences[robot].find('@')) + "/groundtruth.txt");
    if (!truth) return truth.error();
    for (int number = 0;; ++number) {
      auto frame = (*source)->next();
      if (!frame) return frame.error();
      if (!*frame) break;
      if (number % options.every != 0) continue;
      const auto pairs = associate(std::vector<StampedPose>{{(*frame)->stamp_ns, Pose()}}, *truth);
      if (pairs.empty()) continue;
      views.push_back({std::move(**frame), pairs[0].truth.pose, static_cast<uint32_t>(robot)});
    }
  }
  return views;
}

int run(const Options& options) {
  PlyPoints truth;
  if (!options.surface.empty()) {
    auto read = readPly(options.surface);
    if (!read) return fail(read.error());
    truth = std::move(*read);
  }
  const auto views = load(options);
  if (!views) return fail(views.error());
  gpu::DeviceOptions device_options;
  device_options.choice = options.device;
  auto device = gpu::Device::create(device_options);
  if (!device) return fail(device.error());
  const FusionParameters parameters;
  auto map = SurfelMap::create(*device, parameters);
  if (!map) return fail(map.error());
  const int threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  for (int round = 0; round < options.rounds; ++round) {
    for (size_t i = 0; i < views->size(); ++i) {
      const View& view = (*views)[i];
      const auto fused = map->fuse(view.frame.camera, view.frame.colour, view.frame.depth, view.T_world_cam,
                                   static_cast<uint32_t>(i), 1u << view.robot);
      if (!fused) return fail(fused.error());
    }
    std::printf("round %d: %zu keyframes, %zu surfels\n", round + 1, views->size(), map->size());
  }
  const auto surfels = map->download();
  if (!surfels) return fail(surfels.error());
  PlyPoints points;
  std::vector<MapPoint> written;
  for (const Surfel& s : *surfels) {
    if (s.confidence < options.sure) continue;
    points.positions.push_back(s.position);
    points.normals.push_back(s.normal);
    points.radii.push_back(s.radius);
    written.push_back({s.position, s.normal, s.colour, s.radius, s.confidence});
  }
  if (!options.ply.empty()) {
    if (auto done = writePly(options.ply, written); !done) return fail(done.error());
  }
  std::printf("sure         %zu of %zu surfels\n", points.positions.size(), surfels->size());
  std::printf("double walls %.2f %%\n", 100 * findDoubles(points, threads).share());
  if (options.surface.empty() || points.positions.empty()) return 0;
  SurfaceSeen seen(truth.positions);
  for (const View& view : *views) seen.add(view.frame.camera, view.frame.depth, view.T_world_cam, threads);
  const auto score = scoreSurface(points, Pose(), truth, threads, seen.seen());
  std::printf("accuracy     %.4f m mean, %.4f median, %.4f at 90 %%\n", score.accuracy_mean_m, score.accuracy_median_m,
              score.accuracy_p90_m);
  std::printf("complete     %.1f %% within 2 cm, %.1f %% of what was seen (%.1f %% of the truth); by discs %.1f %%\n",
              100 * score.completeness_2cm, 100 * score.completeness_seen_2cm,
              100 * static_cast<double>(score.truth_points_seen) / static_cast<double>(score.truth_points),
              100 * score.covered_seen_2cm);
  return 0;
}

}  // namespace
}  // namespace comap

int main(int argc, char** argv) {
  comap::Options options;
  CLI::App app(
      "Fuses recorded sequences (TUM folders with groundtruth.txt, one world) at their true poses and measures the "
      "map");
  app.add_option("SEQUENCE", options.sequences, "Folders")->required();
  app.add_option("--surface", options.surface, "PLY of the true surface");
  app.add_option("--every", options.every, "Fuse every n-th frame")->check(CLI::PositiveNumber)->capture_default_str();
  app.add_option("--rounds", options.rounds, "Fuse all so many times over")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--sure", options.sure, "Confidence from which surfels count")
      ->check(comap::finiteFromZero())
      ->capture_default_str();
  app.add_option("--ply", options.ply, "Write the sure surfels here");
  app.add_option("--device", options.device, "auto, llvmpipe or an index")->capture_default_str();
  if (const auto code = comap::endOfParsing(app, argc, argv)) return *code;
  return comap::run(options);
}
