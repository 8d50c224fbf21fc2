#include "mapping_core/surfels/prediction.h"

#include <algorithm>
#include <array>
#include <bit>

namespace comap {
namespace {

// As shaders/common/resolving.glsl packs them.
using SurfacePixel = std::array<uint32_t, 4>;
using CertaintyPixel = std::array<uint32_t, 2>;
constexpr float kNormalStep = 1.0f / 8388607.0f;

// The content on the host: mapped, or a copy in `storage`.
template <class T>
Result<const T*> contentOf(const gpu::Buffer& buffer, size_t count, std::vector<T>& storage) {
  if (buffer.mapped()) return static_cast<const T*>(buffer.mapped());
  auto values = buffer.read<T>(count);
  if (!values) return values.error();
  storage = std::move(*values);
  return static_cast<const T*>(storage.data());
}

PredictedView emptyView(const CameraModel& camera) {
  PredictedView view;
  view.camera = camera;
  view.depth_m = Image<float>(camera.width, camera.height, 0.0f);
  view.normal = Image<Eigen::Vector3f>(camera.width, camera.height, Eigen::Vector3f::Zero());
  view.colour = ColourImage(camera.width, camera.height, Rgb{});
  view.confidence = Image<float>(camera.width, camera.height, 0.0f);
  view.contributors = Image<uint32_t>(camera.width, camera.height, 0u);
  return view;
}

Eigen::Vector3f normalOf(const SurfacePixel& words) {
  const auto component = [&](size_t axis) { return static_cast<float>(static_cast<int32_t>(words[axis]) >> 8); };
  return Eigen::Vector3f(component(0), component(1), component(2)) * kNormalStep;
}

PredictedView toView(const CameraModel& camera, const SurfacePixel* surface, const CertaintyPixel* certainty) {
  PredictedView view = emptyView(camera);
  for (size_t i = 0; i < view.depth_m.size(); ++i) {
    const SurfacePixel words = surface[i];
    const auto depth = std::bit_cast<float>(words[3]);
    if (!(depth > 0)) continue;
    view.depth_m.data()[i] = depth;
    view.normal.data()[i] = normalOf(words);
    view.colour.data()[i] = {static_cast<uint8_t>(words[0]), static_cast<uint8_t>(words[1]),
                             static_cast<uint8_t>(words[2])};
    view.confidence.data()[i] = std::bit_cast<float>(certainty[i][0]);
    view.contributors.data()[i] = certainty[i][1];
  }
  return view;
}

Result<void> readBlend(const PredictionBuffers& buffers, PredictedView& view) {
  const size_t pixels = view.depth_m.size();
  std::vector<std::array<uint32_t, 4>> colour_copy;
  std::vector<std::array<int32_t, 4>> normal_copy;
  const auto colours = contentOf(buffers.colour_sums, pixels, colour_copy);
  if (!colours) return colours.error();
  const auto normals = contentOf(buffers.normal_sums, pixels, normal_copy);
  if (!normals) return normals.error();
  for (size_t i = 0; i < pixels; ++i) {
    const auto& sum = (*colours)[i];
    if (!(view.depth_m.data()[i] > 0) || sum[3] == 0) continue;
    const auto mean = [&](uint32_t channel) { return static_cast<uint8_t>((channel + sum[3] / 2) / sum[3]); };
    view.colour.data()[i] = {mean(sum[0]), mean(sum[1]), mean(sum[2])};
    const auto& n = (*normals)[i];
    view.confidence.data()[i] = static_cast<float>(n[3]) / (16.0f * static_cast<float>(sum[3]));
    const Eigen::Vector3f normal(static_cast<float>(n[0]), static_cast<float>(n[1]), static_cast<float>(n[2]));
    if (normal.norm() > 1) view.normal.data()[i] = normal.normalized();
  }
  return {};
}

// Which surfel each pixel shows, and what that looks like. Keys hold 23 bits of index, so chunks go in groups of that
// many surfels.
void recordShown(gpu::Recorder& recorder, const SurfelKernels& kernels, const gpu::Kernel& resolve,
                 std::span<const ChunkRows> seen, const PredictionBuffers& buffers, SplatPush push) {
  const uint32_t pixels = push.width * push.height;
  const uint32_t groups = gpu::groupsFor(pixels, kBlockItems);
  push.clears = 1;
  for (size_t first = 0, end = 0; first < seen.size(); first = end) {
    if (first == 0) {
      recorder.fill(buffers.keys, 0xffffffffu, size_t{pixels} * 4);
    } else {
      recorder.dispatch(*kernels.carry_ranks, {&buffers.keys}, CarryRanksPush{pixels}, groups);
    }
    std::vector<SplatPush> pushes;
    size_t base = 0;
    for (end = first; end < seen.size() && base + seen[end].count <= buffers.group_surfels; base += seen[end++].count) {
      push.base = static_cast<uint32_t>(base);
      push.count = seen[end].count;
      pushes.push_back(push);
      push.clears = 0;
      const SurfelStreams& streams = *seen[end].streams;
      const gpu::Buffer& visible = buffers.visible[end].list;
      recorder.dispatchIndirect(*kernels.splat_index,
                                {&streams.places, &streams.shapes, &buffers.depths, &buffers.keys, &visible},
                                pushes.back(), visible);
    }
    for (size_t i = first; i < end; ++i) {
      const SurfelStreams& streams = *seen[i].streams;
      recorder.dispatch(
          resolve,
          {&streams.places, &streams.shapes, &streams.looks, &buffers.keys, &buffers.surface, &buffers.certainty},
          pushes[i - first], groups);
    }
  }
}

}  // namespace

Result<void> PredictionBuffers::reserve(gpu::Context& context, size_t count) {
  if (count <= pixels) return {};
  const struct {
    gpu::Buffer* buffer;
    size_t bytes;
    const char* name;
  } table[] = {{&depths, 4, "predicted depths"},
               {&keys, 4, "predicted surfels"},
               {&surface, 16, "predicted surface"},
               {&certainty, 8, "predicted certainty"}};
  pixels = 0;
  for (const auto& entry : table) {
    auto buffer = gpu::Buffer::create(context, count * entry.bytes, entry.name);
    if (!buffer) return buffer.error();
    *entry.buffer = std::move(*buffer);
  }
  pixels = count;
  return {};
}

Result<void> PredictionBuffers::reserveBlend(gpu::Context& context, size_t count) {
  if (count <= blended_pixels) return {};
  blended_pixels = 0;
  for (gpu::Buffer* sums : {&colour_sums, &normal_sums}) {
    auto buffer = gpu::Buffer::create(context, count * 16, "blended view");
    if (!buffer) return buffer.error();
    *sums = std::move(*buffer);
  }
  blended_pixels = count;
  return {};
}

Result<PredictedView> predictView(gpu::Context& context, const SurfelKernels& kernels, std::span<const ChunkRows> seen,
                                  PredictionBuffers& buffers, const FramePush& frame, const CameraModel& camera,
                                  const PredictionOptions& options, const SeenStep* times) {
  if (seen.empty()) return emptyView(camera);
  const size_t pixels = size_t{frame.width} * frame.height;
  if (auto done = buffers.reserve(context, pixels); !done) return done.error();
  if (buffers.visible.size() < seen.size()) buffers.visible.resize(seen.size());
  for (size_t i = 0; i < seen.size(); ++i) {
    if (auto done = buffers.visible[i].reserve(context, seen[i].streams->capacity); !done) return done.error();
  }
  if (options.blend) {
    if (auto done = buffers.reserveBlend(context, pixels); !done) return done.error();
  }
  auto recorder = gpu::Recorder::begin(context, static_cast<uint32_t>((5 + VisibleList::kDispatches) * seen.size()));
  if (!recorder) return recorder.error();
  const float min_confidence = std::max(options.min_confidence, 0.0f);
  SplatPush splat{{frame}, min_confidence, options.max_depth_m, options.both_sides ? 1u : 0u, 0, 0, 0};
  recorder->fill(buffers.depths, 0x7f800000u, pixels * 4);  // infinity
  for (size_t i = 0; i < seen.size(); ++i) {
    const SurfelStreams& streams = *seen[i].streams;
    const VisibleList& visible = buffers.visible[i];
    visible.record(*recorder, kernels, streams,
                   {{frame}, seen[i].count, min_confidence, options.max_depth_m, kFootprintMargin_px}, times);
    recorder->dispatchIndirect(*kernels.splat_depth, {&streams.places, &streams.shapes, &buffers.depths, &visible.list},
                               splat, visible.list);
  }
  if (options.blend) {
    recorder->fill(buffers.colour_sums, 0, pixels * 16);
    recorder->fill(buffers.normal_sums, 0, pixels * 16);
    for (size_t i = 0; i < seen.size(); ++i) {
      const SurfelStreams& streams = *seen[i].streams;
      const gpu::Buffer& visible = buffers.visible[i].list;
      recorder->dispatchIndirect(*kernels.blend,
                                 {&streams.places, &streams.shapes, &streams.looks, &buffers.depths, &visible,
                                  &buffers.colour_sums, &buffers.normal_sums},
                                 splat, visible);
    }
  }
  recordShown(*recorder, kernels, times ? *times->kernels->resolve_owner : *kernels.resolve, seen, buffers, splat);
  if (auto done = recorder->submit(); !done) return done.error();
  noteBoxes(seen);

  std::vector<SurfacePixel> surface_copy;
  std::vector<CertaintyPixel> certainty_copy;
  auto surface = contentOf(buffers.surface, pixels, surface_copy);
  if (!surface) return surface.error();
  auto certainty = contentOf(buffers.certainty, pixels, certainty_copy);
  if (!certainty) return certainty.error();
  PredictedView view = toView(camera, *surface, *certainty);
  if (options.blend) {
    if (auto done = readBlend(buffers, view); !done) return done.error();
  }
  return view;
}

}  // namespace comap
