#include "mapping_core/surfels/timed_surfel_map.h"

#include <cassert>

#include "mapping_core/surfels/chunk_list.h"

namespace comap {
struct TimedSurfelMap::State : ChunkList {};

TimedSurfelMap::TimedSurfelMap(std::shared_ptr<SurfelPool> pool, const FusionParameters& parameters)
    : state_(std::make_unique<State>()) {
  assert(pool->timed);
  state_->pool = std::move(pool);
  state_->parameters = parameters;
}

TimedSurfelMap::TimedSurfelMap(TimedSurfelMap&&) noexcept = default;
TimedSurfelMap& TimedSurfelMap::operator=(TimedSurfelMap&&) noexcept = default;
TimedSurfelMap::~TimedSurfelMap() = default;

Result<FusionReport> TimedSurfelMap::fuse(const CameraModel& camera, const ColourImage& colour, const DepthImage& depth,
                                          const Pose& T_map_cam, uint32_t owner, const SeenFilter& now) {
  SeenStep step{now, &*state_->pool->timed};
  step.filter.which = SeenBy::kActive;
  return state_->fuse({camera, colour, depth, {}, T_map_cam, owner, 1u << now.camera}, &step);
}

Result<TimedView> TimedSurfelMap::predict(const CameraModel& camera, const Pose& T_map_cam,
                                          const PredictionOptions& options, const SeenFilter& seen) {
  const SeenStep step{seen, &*state_->pool->timed};
  auto predicted = state_->predict(camera, T_map_cam, options, &step);
  if (!predicted) return predicted.error();
  TimedView view;
  view.owners = std::exchange(predicted->contributors, {});
  view.view = std::move(*predicted);
  return view;
}

Result<void> TimedSurfelMap::rewrite(const std::function<void(TimedSurfel& surfel)>& change) {
  SurfelPool& pool = *state_->pool;
  for (const auto& chunk : state_->chunks) {
    pool.beginStep();
    if (auto done = pool.need(*chunk); !done) return done;
    auto rows = readRows(chunk->streams, chunk->rows);
    if (!rows) return rows.error();
    size_t row = 0;
    for (const Surfel& one : unpack(*rows)) {
      while (!(rows->places[row][3] >= 0)) ++row;
      TimedSurfel surfel{one, rows->times[row]};
      change(surfel);
      const Eigen::Vector3f &p = surfel.surfel.position, &n = surfel.surfel.normal;
      rows->places[row] = {p.x(), p.y(), p.z(), rows->places[row][3]};
      rows->shapes[row] = {n.x(), n.y(), n.z(), rows->shapes[row][3]};
      rows->times[row++] = surfel.seen;
    }
    if (auto done = writeRows(chunk->streams, *rows, 0); !done) return done;
    chunk->bounds = {};
    chunk->bounds.extend(rows->places);
  }
  return {};
}

void TimedSurfelMap::absorb(TimedSurfelMap&& other) {
  assert(other.state_->pool == state_->pool);
  for (auto& chunk : other.state_->chunks) state_->chunks.push_back(std::move(chunk));
  other.state_->chunks.clear();
}

Result<std::vector<TimedSurfel>> TimedSurfelMap::download() const {
  std::vector<TimedSurfel> surfels;
  surfels.reserve(size());
  for (const auto& chunk : state_->chunks) {
    const auto rows = state_->pool->rowsOf(*chunk);
    if (!rows) return rows.error();
    const auto part = unpack(*rows);
    size_t row = 0;
    for (const Surfel& surfel : part) {
      while (!(rows->places[row][3] >= 0)) ++row;
      surfels.push_back({surfel, rows->times[row++]});
    }
  }
  return surfels;
}

size_t TimedSurfelMap::size() const { return state_->size(); }

}  // namespace comap
