// Time of the surfel map's verbs on a map of a given size: a synthetic room of wavy walls seen from its middle.
#include <benchmark/benchmark.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "mapping_core/gpu/recorder.h"
#include "mapping_core/surfels/surfel_map.h"

namespace comap {
namespace {

const CameraModel kCamera{525, 525, 319.5, 239.5, 640, 480};

float wallDepth(double x, double y) { return static_cast<float>(2.5 + 0.2 * std::sin(3 * x) + 0.1 * std::cos(5 * y)); }

DepthImage wallImage() {
  DepthImage depth(kCamera.width, kCamera.height);
  for (int v = 0; v < kCamera.height; ++v) {
    for (int u = 0; u < kCamera.width; ++u) {
      const Eigen::Vector3d ray = kCamera.unproject(u, v, 1);
      double z = 2.5;
      for (int i = 0; i < 8; ++i) z = wallDepth(ray.x() * z, ray.y() * z);
      depth.at(u, v) = static_cast<uint16_t>(std::lround(z * kDepthUnitsPerMetre));
    }
  }
  return depth;
}

// The wall seen, and the rest of the surfels on copies of it behind the camera and beside.
std::vector<Surfel> wallSurfels(size_t count) {
  std::vector<Surfel> surfels;
  for (int copy = 0; surfels.size() < count; ++copy) {
    for (int v = 0; v < 400 && surfels.size() < count; ++v) {
      for (int u = 0; u < 500 && surfels.size() < count; ++u) {
        Surfel s;
        const double x = (u - 250) * 0.0075, y = (v - 200) * 0.0075;
        const Eigen::AngleAxisf turn(static_cast<float>(copy) * 1.2f, Eigen::Vector3f::UnitY());
        s.position = turn * Eigen::Vector3f(static_cast<float>(x), static_cast<float>(y), wallDepth(x, y));
        s.normal = turn * -Eigen::Vector3f::UnitZ();
        s.radius = 0.008f;
        s.confidence = 3;
        s.observations = 4;
        surfels.push_back(s);
      }
    }
  }
  return surfels;
}

gpu::Device& device() {
  static gpu::Device made = [] {
    gpu::DeviceOptions options;
    options.timestamps = true;
    if (const char* choice = std::getenv("COMAP_DEVICE")) options.choice = choice;
    auto created = gpu::Device::create(options);
    if (!created) {
      std::fprintf(stderr, "%s\n", created.error().text.c_str());
      std::exit(3);
    }
    std::fprintf(stderr, "%s\n", created->info().name.c_str());
    return std::move(*created);
  }();
  return made;
}

void reportKernels(benchmark::State& state, const std::map<std::string, gpu::KernelTime>& before) {
  for (const auto& [name, time] : device().kernelTimes()) {
    const auto old = before.find(name);
    const double ms = time.ms - (old == before.end() ? 0 : old->second.ms);
    if (ms > 0) state.counters[name + "_ms"] = ms / static_cast<double>(state.iterations());
  }
}

// Bytes a second that a copy within the device reads and writes.
double copyBandwidth() {
  static const double measured = [] {
    constexpr size_t kBytes = 96u << 20;
    auto from = gpu::Buffer::create(device().context(), kBytes, "from");
    auto to = gpu::Buffer::create(device().context(), kBytes, "to");
    double best = 0;
    for (int i = 0; from && to && i < 5; ++i) {
      auto recorder = gpu::Recorder::begin(device().context());
      if (!recorder) break;
      recorder->copy(*from, *to, kBytes);
      const auto begin = std::chrono::steady_clock::now();
      if (!recorder->submit()) break;
      const std::chrono::duration<double> time = std::chrono::steady_clock::now() - begin;
      best = std::max(best, 2.0 * kBytes / time.count());
    }
    return best;
  }();
  return measured;
}

// What a kernel that reads and writes so many bytes a surfel reaches of a copy's bandwidth.
void reportShare(benchmark::State& state, const std::string& kernel, double bytes) {
  const auto ms = state.counters.find(kernel + "_ms");
  if (ms == state.counters.end() || copyBandwidth() <= 0) return;
  state.counters["copy_GBps"] = copyBandwidth() * 1e-9;
  state.counters[kernel + "_of_copy"] =
      bytes * static_cast<double>(state.range(0)) / (ms->second * 1e-3) / copyBandwidth();
}

SurfelMap mapOf(benchmark::State& state) {
  auto map = SurfelMap::create(device(), {});
  if (!map || !map->append(wallSurfels(static_cast<size_t>(state.range(0))))) {
    std::fprintf(stderr, "no room for the map\n");
    std::exit(3);
  }
  return std::move(*map);
}

void fuse(benchmark::State& state) {
  SurfelMap map = mapOf(state);
  const DepthImage depth = wallImage();
  const ColourImage colour(kCamera.width, kCamera.height, {128, 128, 128});
  (void)map.fuse(kCamera, colour, depth, Pose(), 0, 1);
  const auto before = device().kernelTimes();
  for (auto _ : state) {
    if (!map.fuse(kCamera, colour, depth, Pose(), 0, 1)) state.SkipWithError("fuse failed");
  }
  reportKernels(state, before);
  reportShare(state, "list_visible", 16);
}
BENCHMARK(fuse)
    ->Arg(100'000)
    ->Arg(1'000'000)
    ->Arg(4'000'000)
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();

void predict(benchmark::State& state) {
  SurfelMap map = mapOf(state);
  (void)map.predict(kCamera, Pose(), {});
  const auto before = device().kernelTimes();
  for (auto _ : state) {
    if (!map.predict(kCamera, Pose(), {})) state.SkipWithError("predict failed");
  }
  reportKernels(state, before);
}
BENCHMARK(predict)
    ->Arg(100'000)
    ->Arg(1'000'000)
    ->Arg(4'000'000)
    ->Unit(benchmark::kMillisecond)
    ->MeasureProcessCPUTime()
    ->UseRealTime();

void moveOwners(benchmark::State& state) {
  SurfelMap map = mapOf(state);
  const std::vector<Pose> motions(1, Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, 1e-6)));
  (void)map.moveOwners(motions);
  const auto before = device().kernelTimes();
  for (auto _ : state) {
    if (!map.moveOwners(motions)) state.SkipWithError("move failed");
  }
  reportKernels(state, before);
  reportShare(state, "move_owners", 80);
}
BENCHMARK(moveOwners)->Arg(1'000'000)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()->UseRealTime();

// What a graph correction of 10 of 1000 keyframes costs, made in the order of the surfels.
void moveSome(benchmark::State& state) {
  auto surfels = wallSurfels(static_cast<size_t>(state.range(0)));
  for (size_t i = 0; i < surfels.size(); ++i) surfels[i].owner = static_cast<uint32_t>(i * 1000 / surfels.size());
  auto map = SurfelMap::create(device(), {});
  if (!map || !map->append(surfels)) {
    std::fprintf(stderr, "no room for the map\n");
    std::exit(3);
  }
  std::vector<Pose> motions(1000);
  for (int i = 500; i < 510; ++i) motions[i] = Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 0, 1e-3));
  (void)map->moveOwners(motions);
  const auto before = device().kernelTimes();
  for (auto _ : state) {
    if (!map->moveOwners(motions)) state.SkipWithError("move failed");
  }
  reportKernels(state, before);
}
BENCHMARK(moveSome)->Arg(4'000'000)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime()->UseRealTime();

}  // namespace
}  // namespace comap

BENCHMARK_MAIN();
