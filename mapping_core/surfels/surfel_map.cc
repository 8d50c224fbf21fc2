#include "mapping_core/surfels/surfel_map.h"

#include <cmath>
#include <string>

#include "mapping_core/surfels/compaction.h"
#include "mapping_core/surfels/fusion.h"
#include "mapping_core/surfels/prediction.h"
#include "protocol/types/keyframe.h"

namespace comap {
namespace {

// Gaps are closed when they are more than one in this many: closing costs a copy of the map.
constexpr uint32_t kGapShare = 8;

bool isFinite(const Surfel& s) {
  return s.position.allFinite() && s.normal.allFinite() && std::isfinite(s.radius) && std::isfinite(s.confidence);
}

}  // namespace

struct SurfelMap::State {
  gpu::Context* context = nullptr;
  FusionParameters parameters;
  SurfelKernels kernels;
  SurfelStreams streams;
  KeyframeMaps maps;
  FusionScratch scratch;
  PredictionBuffers prediction;
  gpu::Buffer motions;
  uint32_t rows = 0;  // of the streams in use, gaps included
  uint32_t gaps = 0;
};

Result<SurfelMap> SurfelMap::create(gpu::Device& device, const FusionParameters& parameters) {
  auto state = std::make_unique<State>();
  state->context = &device.context();
  state->parameters = parameters;
  auto kernels = SurfelKernels::create(*state->context);
  if (!kernels) return kernels.error();
  state->kernels = *kernels;
  auto streams = SurfelStreams::create(*state->context,
                                       std::clamp<size_t>(parameters.initial_capacity, kBlockItems, kMostSurfels));
  if (!streams) return streams.error();
  state->streams = std::move(*streams);
  return SurfelMap(std::move(state));
}

SurfelMap::SurfelMap(std::unique_ptr<State> state) : state_(std::move(state)) {}
SurfelMap::SurfelMap(SurfelMap&&) noexcept = default;
SurfelMap& SurfelMap::operator=(SurfelMap&&) noexcept = default;
SurfelMap::~SurfelMap() = default;

Result<FusionReport> SurfelMap::fuse(const CameraModel& camera, const ColourImage& colour, const DepthImage& depth,
                                     const Pose& T_map_cam, uint32_t owner, uint32_t robot_bit,
                                     const Image<uint8_t>& depth_hits) {
  State& s = *state_;
  if (auto done = checkCamera(camera, T_map_cam); !done) return done.error();
  const auto fits = [&](const auto& image) { return image.width() == camera.width && image.height() == camera.height; };
  if (!fits(colour) || !fits(depth)) {
    return Error{ErrorCode::kWrongUse, "keyframe has colour of " + std::to_string(colour.width()) + " x " +
                                           std::to_string(colour.height()) + " and depth of " +
                                           std::to_string(depth.width()) + " x " + std::to_string(depth.height()) +
                                           " pixels, expected the camera's " + std::to_string(camera.width) + " x " +
                                           std::to_string(camera.height)};
  }
  const auto blocks = [](int pixels) { return (pixels + kHitBlock - 1) / kHitBlock; };
  if (!depth_hits.empty() &&
      (depth_hits.width() != blocks(camera.width) || depth_hits.height() != blocks(camera.height))) {
    return Error{ErrorCode::kWrongUse, "keyframe has depth hits of " + std::to_string(depth_hits.width()) + " x " +
                                           std::to_string(depth_hits.height()) + " blocks, expected " +
                                           std::to_string(blocks(camera.width)) + " x " +
                                           std::to_string(blocks(camera.height))};
  }
  const size_t room = s.rows + mostInsertions(camera);
  if (auto done = s.streams.reserve(*s.context, room, s.rows); !done) return done.error();
  if (auto done = s.scratch.reserve(*s.context, s.streams.capacity); !done) return done.error();
  if (auto done = s.maps.reserve(*s.context, depth.size()); !done) return done.error();
  if (auto done = s.maps.upload(colour, depth, depth_hits, s.parameters); !done) return done.error();

  const FusionStep step{framePush(camera, T_map_cam, s.parameters), s.rows, owner, robot_bit};
  auto counts = fuseKeyframe(*s.context, s.kernels, s.streams, s.maps, s.scratch, s.parameters, step);
  if (!counts) return counts.error();
  s.rows += counts->inserted;
  s.gaps += counts->removed;
  if (s.gaps > s.rows / kGapShare) {
    auto left = compactStreams(*s.context, s.kernels, s.streams, s.scratch, s.rows);
    if (!left) return left.error();
    s.rows = *left;
    s.gaps = 0;
  }
  return FusionReport{counts->updated, counts->inserted, counts->removed, static_cast<uint32_t>(size())};
}

Result<PredictedView> SurfelMap::predict(const CameraModel& camera, const Pose& T_map_cam,
                                         const PredictionOptions& options) {
  State& s = *state_;
  if (auto done = checkCamera(camera, T_map_cam); !done) return done.error();
  return predictView(*s.context, s.kernels, s.streams, s.rows, s.prediction, framePush(camera, T_map_cam, s.parameters),
                     camera, options);
}

Result<void> SurfelMap::moveOwners(std::span<const Pose> T_new_old) {
  State& s = *state_;
  std::vector<float> rows;
  rows.reserve(T_new_old.size() * 12);
  for (size_t owner = 0; owner < T_new_old.size(); ++owner) {
    if (!T_new_old[owner].isFinite()) {
      return Error{ErrorCode::kWrongUse, "motion of keyframe " + std::to_string(owner) + " is not finite"};
    }
    const Eigen::Matrix4d matrix = T_new_old[owner].matrix();
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 4; ++column) rows.push_back(static_cast<float>(matrix(row, column)));
    }
  }
  if (rows.empty() || s.rows == 0) return {};
  const size_t bytes = rows.size() * sizeof(float);
  if (s.motions.bytes() < bytes) {
    auto motions = gpu::Buffer::create(*s.context, bytes, "owner motions");
    if (!motions) return motions.error();
    s.motions = std::move(*motions);
  }
  if (auto done = s.motions.write(rows.data(), bytes); !done) return done;
  auto recorder = gpu::Recorder::begin(*s.context);
  if (!recorder) return recorder.error();
  recorder->dispatch(*s.kernels.move_owners, {&s.streams.places, &s.streams.shapes, &s.streams.looks, &s.motions},
                     MoveOwnersPush{s.rows, static_cast<uint32_t>(T_new_old.size())},
                     gpu::groupsFor(s.rows, kBlockItems));
  return recorder->submit();
}

Result<std::vector<Surfel>> SurfelMap::download() {
  auto rows = readRows(state_->streams, state_->rows);
  if (!rows) return rows.error();
  return unpack(*rows);
}

Result<void> SurfelMap::append(std::span<const Surfel> surfels) {
  State& s = *state_;
  for (size_t i = 0; i < surfels.size(); ++i) {
    if (!isFinite(surfels[i])) {
      return Error{ErrorCode::kBadData,
                   "surfel " + std::to_string(i) + " of " + std::to_string(surfels.size()) + " is not finite"};
    }
  }
  if (auto done = s.streams.reserve(*s.context, s.rows + surfels.size(), s.rows); !done) return done;
  if (auto done = writeRows(s.streams, pack(surfels), s.rows); !done) return done;
  s.rows += static_cast<uint32_t>(surfels.size());
  return {};
}

void SurfelMap::clear() {
  state_->rows = 0;
  state_->gaps = 0;
}

size_t SurfelMap::size() const { return state_->rows - state_->gaps; }

}  // namespace comap
