#include "mapping_core/surfels/keyframe_maps.h"

#include <cmath>
#include <string>
#include <vector>

#include "protocol/types/keyframe.h"

namespace comap {
namespace {

constexpr size_t kMostPixels = 1u << 23;  // 16 bytes of each fit into 128 MiB

}  // namespace

Result<void> checkCamera(const CameraModel& camera, const Pose& T_map_cam) {
  const auto refuse = [](const std::string& text) { return Error{ErrorCode::kWrongUse, text}; };
  if (camera.width <= 0 || camera.height <= 0 ||
      static_cast<size_t>(camera.width) * static_cast<size_t>(camera.height) > kMostPixels) {
    return refuse("camera is " + std::to_string(camera.width) + " x " + std::to_string(camera.height) +
                  " pixels, expected 1 to " + std::to_string(kMostPixels) + " in all");
  }
  const bool finite =
      std::isfinite(camera.fx) && std::isfinite(camera.fy) && std::isfinite(camera.cx) && std::isfinite(camera.cy);
  if (!finite || camera.fx <= 0 || camera.fy == 0) {
    return refuse("camera has fx " + std::to_string(camera.fx) + " and fy " + std::to_string(camera.fy) +
                  ", expected a positive and a non-zero number");
  }
  if (!T_map_cam.isFinite()) return refuse("camera pose is not finite");
  return {};
}

Result<void> KeyframeMaps::reserve(gpu::Context& context, size_t count) {
  if (count <= pixels) return {};
  const struct {
    gpu::Buffer* buffer;
    size_t bytes;
    const char* name;
  } table[] = {{&raw, 4, "inverse depth"},       {&rows, 4, "inverse depth filtered along rows"},
               {&filtered, 4, "filtered depth"}, {&measurements, 16, "measurements"},
               {&colours, 4, "colours"},         {&winners, 36, "winning surfels"},
               {&covered, 4, "covered pixels"}};
  pixels = 0;
  for (const auto& entry : table) {
    auto buffer = gpu::Buffer::create(context, count * entry.bytes, entry.name);
    if (!buffer) return buffer.error();
    *entry.buffer = std::move(*buffer);
  }
  pixels = count;
  return {};
}

Result<void> KeyframeMaps::upload(const ColourImage& colour, const DepthImage& depth, const Image<uint8_t>& depth_hits,
                                  const FusionParameters& parameters) {
  std::vector<float> inverse(depth.size());
  for (size_t i = 0; i < depth.size(); ++i) {
    const float z = static_cast<float>(depth.data()[i] / kDepthUnitsPerMetre);
    const bool fused = z >= parameters.depth_min_m && z <= parameters.depth_max_m;
    const bool frees = z > parameters.depth_max_m && z <= parameters.free_max_m;
    inverse[i] = fused ? 1.0f / z : frees ? -1.0f / z : 0.0f;
  }
  std::vector<uint32_t> packed(colour.size());
  for (int y = 0; y < colour.height(); ++y) {
    const uint8_t* hits = depth_hits.empty() ? nullptr : &depth_hits.at(0, y / kHitBlock);
    const size_t row = static_cast<size_t>(y) * static_cast<size_t>(colour.width());
    for (int x = 0; x < colour.width(); ++x) {
      const Rgb c = colour.at(x, y);
      const uint32_t frames = hits ? hits[x / kHitBlock] : 1u;
      packed[row + static_cast<size_t>(x)] = uint32_t{c.r} | uint32_t{c.g} << 8 | uint32_t{c.b} << 16 | frames << 24;
    }
  }
  if (auto done = raw.write(inverse.data(), inverse.size() * sizeof(float)); !done) return done;
  return colours.write(packed.data(), packed.size() * sizeof(uint32_t));
}

void KeyframeMaps::recordMeasure(gpu::Recorder& recorder, const SurfelKernels& kernels, const FramePush& frame) const {
  const uint32_t groups = gpu::groupsFor(size_t{frame.width} * frame.height, kBlockItems);
  FilterDepthPush filter{frame.width, frame.height, 0, frame.noise_floor, frame.noise_factor};
  recorder.dispatch(*kernels.filter_depth, {&raw, &rows}, filter, groups);
  filter.along_columns = 1;
  recorder.dispatch(*kernels.filter_depth, {&rows, &filtered}, filter, groups);
  recorder.dispatch(*kernels.measure, {&filtered, &measurements}, frame, groups);
}

}  // namespace comap
