// Surfels in device memory, as a structure of arrays; see shaders/common/surfel.glsl for what the words mean.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "mapping_core/gpu/buffer.h"
#include "mapping_core/surfels/seen_times.h"
#include "mapping_core/surfels/surfel_map.h"

namespace comap {

/// Most surfels that one keyframe is fused with, and that one group of a prediction holds: indices have 23 bits.
inline constexpr size_t kMostSurfels = (1u << 23) - 1;

struct SurfelStreams {
  gpu::Buffer places;   ///< 16 bytes a surfel
  gpu::Buffer shapes;   ///< 16 bytes
  gpu::Buffer looks;    ///< 16 bytes
  gpu::Buffer records;  ///< 8 bytes
  gpu::Buffer times;    ///< 16 bytes, SeenTimes; only of timed maps
  gpu::Buffer boxes;    ///< 32 bytes a block of kBlockItems rows, see shaders/bound_blocks.comp
  gpu::Buffer touched;  ///< 4 bytes a block: not 0 if a fusion has changed or removed a row since clearTouched()
  size_t capacity = 0;
  uint32_t boxed = 0;  ///< rows whose boxes hold; who moves or writes rows takes them back
  uint32_t fused = 0;  ///< fusions since boxes were made

  static Result<SurfelStreams> create(gpu::Context& context, size_t capacity, bool timed = false);
  bool timed() const { return times.bytes() > 0; }
};

struct StreamRows {
  std::vector<std::array<float, 4>> places, shapes;
  std::vector<std::array<uint32_t, 4>> looks;
  std::vector<std::array<uint32_t, 2>> records;
  std::vector<SeenTimes> times;  ///< empty unless timed
};

/// A surfel from outside has no record: its precision is taken to be its confidence.
StreamRows pack(std::span<const Surfel> surfels);
/// Without those that are removed.
std::vector<Surfel> unpack(const StreamRows& rows);
/// The same of some rows.
std::vector<Surfel> unpack(const StreamRows& rows, size_t first, size_t count);

Result<StreamRows> readRows(const SurfelStreams& streams, size_t count, size_t first = 0);
Result<void> clearTouched(SurfelStreams& streams);
/// Boxes of the rows from `first` on are to be made anew, here and when rows are copied.
Result<void> writeRows(SurfelStreams& streams, const StreamRows& rows, size_t first);
/// Copies the first `count` rows, on the device, to the rows from `first` on.
Result<void> copyRows(gpu::Context& context, const SurfelStreams& from, size_t count, SurfelStreams& to, size_t first);

}  // namespace comap
