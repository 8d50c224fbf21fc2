// Data sets made from analytic scenes: several robots, exact truth.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "protocol/types/result.h"

namespace comap {

struct SynthOptions {
  std::string scene = "flat";
  int robots = 2;
  int frames = 200;
  uint64_t seed = 1;
  bool kinect_noise = true;
  std::string out;
  int threads = 2;
};

struct SynthSummary {
  size_t frames = 0;
  size_t surface_points = 0;
  double wall_s = 0;
};

/// Writes out/a, out/b, ... as TUM-format folders, out/surface.ply and out/README.txt. The same options give the same
/// bytes, whatever `threads`. A folder that holds an earlier data set of this kind is replaced; any other folder with
/// something in it is refused (kWrongUse). `progress(done, total)` is called after each frame.
Result<SynthSummary> synthesise(const SynthOptions& options, const std::function<void(size_t, size_t)>& progress);

}  // namespace comap
