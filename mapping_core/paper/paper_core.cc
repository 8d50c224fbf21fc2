#include "mapping_core/paper/paper_core.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <set>

#include "mapping_core/paper/merge_frames.h"
#include "mapping_core/paper/stopwatch.h"
#include "mapping_core/surfels/surfel_pool.h"

namespace comap {
namespace {

bool fitsCamera(const Frame& frame) {
  const auto fits = [&](const auto& image) {
    return image.width() == frame.camera.width && image.height() == frame.camera.height && !image.empty();
  };
  return fits(frame.colour) && fits(frame.depth);
}

std::string loopText(const StepReport& step) {
  const std::string kind = step.local_loop ? "local" : "global";
  if (step.loop.free_nodes == 0)
    return fmt::format("closed a {} loop by moving alone: no node of the map was free to bend", kind);
  return fmt::format("closed a {} loop: {} points, {} nodes free, {:.4f} m apart before and {:.4f} m after", kind,
                     step.loop.constraints, step.loop.free_nodes, step.loop.solve.start_error_m,
                     step.loop.solve.mean_error_m);
}

}  // namespace

Result<std::unique_ptr<PaperCore>> PaperCore::create(gpu::Device& device, const PaperOptions& options, Log log) {
  auto pool = SurfelPool::create(device, size_t{options.fusion.memory_mb} << 20, true);
  if (!pool) return pool.error();
  return std::unique_ptr<PaperCore>(new PaperCore(options, std::move(*pool), std::move(log)));
}

PaperCore::PaperCore(const PaperOptions& options, std::shared_ptr<SurfelPool> pool, Log log)
    : options_(options),
      book_(FernBook::standard(options.ferns.seed)),
      pool_(std::move(pool)),
      log_(std::move(log)),
      mapper_(options_, book_),
      inter_map_(options_, book_) {}

Result<uint32_t> PaperCore::addCamera(const std::string& name) {
  if (cameras_.size() == kMostCameras)
    return Error{ErrorCode::kWrongUse, "camera " + name + ": the paper mode takes at most " +
                                           std::to_string(kMostCameras) + " cameras, surfels have no room for more"};
  const auto index = static_cast<uint32_t>(cameras_.size());
  frames_.push_back(std::make_unique<ReferenceFrame>(
      ReferenceFrame{name, TimedSurfelMap(pool_, options_.fusion), FernMemory(options_.ferns)}));
  PaperCamera camera;
  camera.index = index;
  camera.name = name;
  camera.frame = frames_.size() - 1;
  cameras_.push_back(std::move(camera));
  return index;
}

Result<void> PaperCore::playRound(const std::vector<std::optional<Frame>>& frames) {
  if (tick_ == kLastTick)
    return Error{ErrorCode::kWrongUse,
                 "the paper mode takes at most " + std::to_string(kLastTick) + " frames a camera"};
  if (frames.size() != cameras_.size())
    return Error{ErrorCode::kWrongUse, fmt::format("a round has {} frames, expected one for each of {} cameras",
                                                   frames.size(), cameras_.size())};
  for (size_t i = 0; i < frames.size(); ++i)
    if (frames[i] && !fitsCamera(*frames[i]))
      return Error{
          ErrorCode::kWrongUse,
          fmt::format("camera {}: colour of {} x {} and depth of {} x {} pixels, expected "
                      "the camera's {} x {}",
                      cameras_[i].name, frames[i]->colour.width(), frames[i]->colour.height(), frames[i]->depth.width(),
                      frames[i]->depth.height(), frames[i]->camera.width, frames[i]->camera.height)};
  ++tick_;
  std::vector<PaperFrameRecord> records;
  for (uint32_t i = 0; i < cameras_.size(); ++i) {
    if (!frames[i]) continue;
    PaperCamera& camera = cameras_[i];
    auto step = mapper_.step(*frames_[camera.frame], cameras_, i, owners_, *frames[i], tick_);
    if (!step) return Error{step.error().code, "camera " + camera.name + ": " + step.error().text};
    if (step->lost) log_(fmt::format("tick {}: camera {} could not be tracked", tick_, camera.name));
    if (step->local_loop || step->global_loop)
      log_(fmt::format("tick {}: camera {} {}", tick_, camera.name, loopText(*step)));
    PaperFrameRecord record;
    record.tick = tick_;
    record.camera = i;
    record.ms = step->ms;
    record.lost = step->lost;
    record.local_loop = step->local_loop;
    record.global_loop = step->global_loop;
    record.loop_points = step->loop.constraints;
    record.loop_nodes = step->loop.free_nodes;
    records.push_back(record);
  }
  for (PaperFrameRecord& record : records) {
    Stopwatch clock;
    if (!record.lost) {
      if (auto done = joinMaps(record.camera, record); !done) return done;
    }
    record.inter_map_ms = clock.lap();
    record.maps = maps().size();
    record.surfels = frameOf(record.camera).map.size();
    records_.push_back(record);
  }
  return {};
}

// Asks all other maps whether they hold what this camera sees, until none does.
Result<void> PaperCore::joinMaps(uint32_t index, PaperFrameRecord& record) {
  for (bool again = true; again;) {
    again = false;
    for (size_t other = 0; other < frames_.size(); ++other) {
      PaperCamera& camera = cameras_[index];
      const bool inhabited =
          std::any_of(cameras_.begin(), cameras_.end(), [&](const auto& c) { return c.frame == other; });
      if (other == camera.frame || !inhabited) continue;
      ReferenceFrame &own = *frames_[camera.frame], &kept = *frames_[other];
      const auto match = inter_map_.find(camera, own.name, kept, mapper_.registrar(), tick_);
      if (!match) return match.error();
      if (!*match) continue;
      PaperMerge merge;
      merge.tick = tick_;
      merge.kept = kept.name;
      merge.absorbed = own.name;
      merge.camera = camera.name;
      merge.match = **match;
      const size_t absorbed = camera.frame;
      for (const PaperCamera& one : cameras_)
        if (one.frame == absorbed) merge.cameras.push_back(one.name);
      if (auto done = mergeFrames(kept, other, own, absorbed, merge.match.T_other_own, cameras_, tick_); !done)
        return done;
      log_(fmt::format("tick {}: map {} taken into {} by camera {}: {} inliers, rms {:.4f} m, variance {:.1e}", tick_,
                       merge.absorbed, merge.kept, merge.camera, merge.match.fit.inliers, merge.match.fit.rms_m,
                       merge.match.fit.worst_variance));
      merges_.push_back(std::move(merge));
      record.merged = true;
      again = true;
      break;
    }
  }
  return {};
}

std::vector<const ReferenceFrame*> PaperCore::maps() const {
  std::set<size_t> inhabited;
  for (const PaperCamera& camera : cameras_) inhabited.insert(camera.frame);
  std::vector<const ReferenceFrame*> maps;
  for (const size_t frame : inhabited) maps.push_back(frames_[frame].get());
  return maps;
}

}  // namespace comap
