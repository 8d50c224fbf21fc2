#include "mapping_core/paper/sequential_mapper.h"

#include "mapping_core/paper/global_loop.h"
#include "mapping_core/paper/local_loop.h"
#include "mapping_core/paper/stopwatch.h"

namespace comap {
namespace {

constexpr double kLeastInactive = 0.08;  // of the picture: fewer pixels than a local loop asks for

}  // namespace

SequentialMapper::SequentialMapper(const PaperOptions& options, const FernBook& book)
    : options_(options), book_(book), registrar_(options) {}

Result<StepReport> SequentialMapper::step(ReferenceFrame& frame, std::vector<PaperCamera>& cameras, uint32_t index,
                                          std::vector<FrameTime>& owners, const Frame& image, uint32_t tick) {
  PaperCamera& camera = cameras[index];
  StepReport report;
  Stopwatch clock;
  Pyramid live;
  buildPyramid(image.colour, image.depth, image.camera, kDenseLevels, options_.fusion.depth_min_m,
               options_.fusion.depth_max_m, live);
  camera.model = image.camera;
  if (!camera.log.empty()) track(camera, live, report);
  report.ms.track = clock.lap();
  if (report.lost) {
    // The next frame starts from the last one that was tracked.
    camera.log.push_back({tick, image.stamp_ns, camera.T_map_cam});
    return report;
  }
  camera.live = std::move(live);

  if (!camera.log.empty()) {
    const LoopContext context{frame, cameras, camera, owners, options_, registrar_, tick};
    if (auto done = closeLoops(context, image, report); !done) return done.error();
  }
  report.ms.loop = clock.lap();

  if (auto done = fuse(frame, camera, owners, image, tick); !done) return done.error();
  camera.log.push_back({tick, image.stamp_ns, camera.T_map_cam});
  report.ms.fuse = clock.lap();

  if (auto done = predict(frame, camera, image, tick); !done) return done.error();
  report.ms.predict = clock.lap();

  frame.ferns.harvest(fernViewOf(book_, camera.filled, camera.model), {camera.index, tick}, camera.T_map_cam);
  report.ms.ferns = clock.lap();
  return report;
}

void SequentialMapper::track(PaperCamera& camera, const Pyramid& live, StepReport& report) {
  const Alignment found = registrar_.align(camera.reference, live, registrar_.turn(camera.live, live));
  constexpr double kInlierRatio = 0.5, kPhotometric = 20;
  const bool believed =
      found.solved && found.T_ref_cur.isFinite() && found.T_ref_cur.translation().norm() <= options_.largest_step_m;
  const bool checked =
      !options_.fixes.check_tracking || (found.inlier_ratio > kInlierRatio && found.photometric_median < kPhotometric);
  report.lost = !believed || !checked;
  if (!report.lost) camera.T_map_cam = camera.T_map_cam * found.T_ref_cur;
}

Result<void> SequentialMapper::closeLoops(const LoopContext& context, const Frame& image, StepReport& report) {
  const PaperCamera& camera = context.camera;
  const ActiveRegion region(context.frame.map, camera, options_, context.tick);
  const bool may_be_global = mayCloseGlobalLoop(context);
  const auto inactive = region.inactiveShare(camera.T_map_cam);
  if (!inactive) return inactive.error();
  const bool may_be_local = *inactive > kLeastInactive;
  if (!may_be_global && !may_be_local) return {};
  auto active = region.predictActive(camera.T_map_cam);
  if (!active) return active.error();
  if (may_be_global) {
    const FilledView filled = fillView(active->view, image, options_.fusion.depth_min_m, options_.fusion.depth_max_m);
    const auto global = closeGlobalLoop(context, fernViewOf(book_, filled, camera.model));
    if (!global) return global.error();
    report.global_loop = global->closed;
    if (global->closed) report.loop = *global;
  }
  if (report.global_loop || !may_be_local) return {};
  const auto local = closeLocalLoop(context, *active);
  if (!local) return local.error();
  report.local_loop = local->closed;
  if (local->closed) report.loop = *local;
  return {};
}

Result<void> SequentialMapper::fuse(ReferenceFrame& frame, PaperCamera& camera, std::vector<FrameTime>& owners,
                                    const Frame& image, uint32_t tick) {
  const auto owner = static_cast<uint32_t>(owners.size());
  owners.push_back({camera.index, tick});
  const ActiveRegion region(frame.map, camera, options_, tick);
  auto fused =
      frame.map.fuse(image.camera, image.colour, image.depth, camera.T_map_cam, owner, region.filter(SeenBy::kActive));
  if (!fused) return fused.error();
  return {};
}

Result<void> SequentialMapper::predict(ReferenceFrame& frame, PaperCamera& camera, const Frame& image, uint32_t tick) {
  const ActiveRegion region(frame.map, camera, options_, tick);
  auto view = region.predictActive(camera.T_map_cam);
  if (!view) return view.error();
  camera.filled = fillView(std::move(view->view), image, options_.fusion.depth_min_m, options_.fusion.depth_max_m);
  const bool dense = camera.filled.dense_share > options_.dense_share;
  buildPyramid(camera.filled.colour, dense ? camera.filled.predicted_m : camera.filled.depth_m, camera.model,
               kDenseLevels, camera.reference);
  return {};
}

}  // namespace comap
