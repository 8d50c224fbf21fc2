#include "mapping_core/surfels/prediction.h"

#include <algorithm>
#include <array>
#include <bit>

namespace comap {
namespace {

constexpr float kFootprintMargin_px = 33;  // a disc reaches that far at most, see shaders/common/disc.glsl

using SurfacePixel = std::array<float, 4>;
using AppearancePixel = std::array<uint32_t, 4>;

// The content on the host: mapped, or a copy in `storage`.
template <class T>
Result<const T*> contentOf(const gpu::Buffer& buffer, size_t count, std::vector<T>& storage) {
  if (buffer.mapped()) return static_cast<const T*>(buffer.mapped());
  auto values = buffer.read<T>(count);
  if (!values) return values.error();
  storage = std::move(*values);
  return static_cast<const T*>(storage.data());
}

PredictedView toView(const CameraModel& camera, const SurfacePixel* surface, const AppearancePixel* appearance) {
  PredictedView view;
  view.camera = camera;
  view.depth_m = Image<float>(camera.width, camera.height);
  view.normal = Image<Eigen::Vector3f>(camera.width, camera.height, Eigen::Vector3f::Zero());
  view.colour = ColourImage(camera.width, camera.height);
  view.confidence = Image<float>(camera.width, camera.height);
  view.contributors = Image<uint32_t>(camera.width, camera.height);
  for (size_t i = 0; i < view.depth_m.size(); ++i) {
    view.depth_m.data()[i] = surface[i][3];
    view.normal.data()[i] = {surface[i][0], surface[i][1], surface[i][2]};
    const uint32_t c = appearance[i][0];
    view.colour.data()[i] = {static_cast<uint8_t>(c), static_cast<uint8_t>(c >> 8), static_cast<uint8_t>(c >> 16)};
    view.confidence.data()[i] = std::bit_cast<float>(appearance[i][1]);
    view.contributors.data()[i] = appearance[i][2];
  }
  return view;
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
               {&appearance, 16, "predicted appearance"}};
  pixels = 0;
  for (const auto& entry : table) {
    auto buffer = gpu::Buffer::create(context, count * entry.bytes, entry.name);
    if (!buffer) return buffer.error();
    *entry.buffer = std::move(*buffer);
  }
  pixels = count;
  return {};
}

Result<PredictedView> predictView(gpu::Context& context, const SurfelKernels& kernels, const SurfelStreams& streams,
                                  uint32_t count, PredictionBuffers& buffers, const FramePush& frame,
                                  const CameraModel& camera, const PredictionOptions& options) {
  const size_t pixels = size_t{frame.width} * frame.height;
  if (auto done = buffers.reserve(context, pixels); !done) return done.error();
  if (auto done = buffers.visible.reserve(context, streams.capacity); !done) return done.error();
  auto recorder = gpu::Recorder::begin(context);
  if (!recorder) return recorder.error();
  const float min_confidence = std::max(options.min_confidence, 0.0f);
  const SplatPush splat{{frame}, min_confidence, options.max_depth_m, options.both_sides ? 1u : 0u};
  recorder->fill(buffers.depths, 0x7f800000u, pixels * 4);  // infinity
  recorder->fill(buffers.keys, 0xffffffffu, pixels * 4);
  buffers.visible.record(*recorder, kernels, streams,
                         {{frame}, count, min_confidence, options.max_depth_m, kFootprintMargin_px});
  const gpu::Buffer& visible = buffers.visible.list;
  recorder->dispatchIndirect(*kernels.splat_depth, {&streams.places, &streams.shapes, &buffers.depths, &visible}, splat,
                             visible);
  recorder->dispatchIndirect(*kernels.splat_index,
                             {&streams.places, &streams.shapes, &buffers.depths, &buffers.keys, &visible}, splat,
                             visible);
  recorder->dispatch(
      *kernels.resolve,
      {&streams.places, &streams.shapes, &streams.looks, &buffers.keys, &buffers.surface, &buffers.appearance}, splat,
      gpu::groupsFor(pixels, kBlockItems));
  if (auto done = recorder->submit(); !done) return done.error();

  std::vector<SurfacePixel> surface_copy;
  std::vector<AppearancePixel> appearance_copy;
  auto surface = contentOf(buffers.surface, pixels, surface_copy);
  if (!surface) return surface.error();
  auto appearance = contentOf(buffers.appearance, pixels, appearance_copy);
  if (!appearance) return appearance.error();
  return toView(camera, *surface, *appearance);
}

}  // namespace comap
