#include "mapping_core/surfels/surfel_streams.h"

#include <algorithm>
#include <bit>
#include <string>

#include "mapping_core/gpu/recorder.h"
#include "mapping_core/surfels/surfel_kernels.h"

namespace comap {

Result<SurfelStreams> SurfelStreams::create(gpu::Context& context, size_t capacity, bool timed) {
  SurfelStreams streams;
  streams.capacity = capacity;
  const struct {
    gpu::Buffer* buffer;
    size_t bytes;
    const char* name;
  } table[] = {{&streams.places, 16, "surfel places"},
               {&streams.shapes, 16, "surfel shapes"},
               {&streams.looks, 16, "surfel looks"},
               {&streams.records, 8, "surfel records"},
               {&streams.times, 16, "surfel times"}};
  const size_t blocks = gpu::groupsFor(capacity, kBlockItems);
  auto boxes = gpu::Buffer::create(context, blocks * 32, "surfel boxes");
  if (!boxes) return boxes.error();
  streams.boxes = std::move(*boxes);
  auto touched = gpu::Buffer::create(context, blocks * 4, "touched blocks");
  if (!touched) return touched.error();
  streams.touched = std::move(*touched);
  if (auto cleared = clearTouched(streams); !cleared) return cleared.error();
  for (const auto& entry : table) {
    if (entry.buffer == &streams.times && !timed) continue;
    auto buffer = gpu::Buffer::create(context, capacity * entry.bytes, entry.name);
    if (!buffer) return buffer.error();
    *entry.buffer = std::move(*buffer);
  }
  return streams;
}

Result<void> copyRows(gpu::Context& context, const SurfelStreams& from, size_t count, SurfelStreams& to, size_t first) {
  auto recorder = gpu::Recorder::begin(context);
  if (!recorder) return recorder.error();
  recorder->copy(from.places, to.places, count * 16, first * 16);
  recorder->copy(from.shapes, to.shapes, count * 16, first * 16);
  recorder->copy(from.looks, to.looks, count * 16, first * 16);
  recorder->copy(from.records, to.records, count * 8, first * 8);
  if (from.timed()) recorder->copy(from.times, to.times, count * 16, first * 16);
  to.boxed = std::min(to.boxed, static_cast<uint32_t>(first));
  return recorder->submit();
}

StreamRows pack(std::span<const Surfel> surfels) {
  StreamRows rows;
  for (const Surfel& s : surfels) {
    rows.places.push_back({s.position.x(), s.position.y(), s.position.z(), std::max(s.confidence, 0.0f)});
    rows.shapes.push_back({s.normal.x(), s.normal.y(), s.normal.z(), s.radius});
    const auto word = [](uint8_t channel) { return uint32_t{channel} << 8; };
    rows.looks.push_back({word(s.colour.r) | word(s.colour.g) << 16,
                          word(s.colour.b) | std::min(s.observations, 0xffffu) << 16, s.owner, s.contributors});
    rows.records.push_back({std::bit_cast<uint32_t>(std::max(s.confidence, 0.0f)), 0});
  }
  return rows;
}

std::vector<Surfel> unpack(const StreamRows& rows) { return unpack(rows, 0, rows.places.size()); }

std::vector<Surfel> unpack(const StreamRows& rows, size_t first, size_t count) {
  std::vector<Surfel> surfels;
  surfels.reserve(count);
  const auto channel = [](uint32_t value) { return static_cast<uint8_t>(std::min((value + 128) >> 8, 255u)); };
  for (size_t i = first; i < first + count; ++i) {
    const auto& place = rows.places[i];
    if (!(place[3] >= 0)) continue;
    const auto& shape = rows.shapes[i];
    const auto& look = rows.looks[i];
    Surfel& s = surfels.emplace_back();
    s.position = {place[0], place[1], place[2]};
    s.confidence = place[3];
    s.normal = {shape[0], shape[1], shape[2]};
    s.radius = shape[3];
    s.colour = {channel(look[0] & 0xffff), channel(look[0] >> 16), channel(look[1] & 0xffff)};
    s.observations = look[1] >> 16;
    s.owner = look[2];
    s.contributors = look[3];
  }
  return surfels;
}

Result<void> clearTouched(SurfelStreams& streams) {
  const std::vector<uint32_t> none(streams.touched.bytes() / sizeof(uint32_t));
  return streams.touched.write(std::span(none));
}

Result<StreamRows> readRows(const SurfelStreams& streams, size_t count, size_t first) {
  StreamRows rows;
  rows.places.resize(count);
  rows.shapes.resize(count);
  rows.looks.resize(count);
  rows.records.resize(count);
  if (auto done = streams.places.read(rows.places.data(), count * 16, first * 16); !done) return done.error();
  if (auto done = streams.shapes.read(rows.shapes.data(), count * 16, first * 16); !done) return done.error();
  if (auto done = streams.looks.read(rows.looks.data(), count * 16, first * 16); !done) return done.error();
  if (auto done = streams.records.read(rows.records.data(), count * 8, first * 8); !done) return done.error();
  if (streams.timed()) {
    rows.times.resize(count);
    if (auto done = streams.times.read(rows.times.data(), count * 16, first * 16); !done) return done.error();
  }
  return rows;
}

Result<void> writeRows(SurfelStreams& streams, const StreamRows& rows, size_t first) {
  const size_t count = rows.places.size();
  streams.boxed = std::min(streams.boxed, static_cast<uint32_t>(first));
  if (auto done = streams.places.write(rows.places.data(), count * 16, first * 16); !done) return done;
  if (auto done = streams.shapes.write(rows.shapes.data(), count * 16, first * 16); !done) return done;
  if (auto done = streams.looks.write(rows.looks.data(), count * 16, first * 16); !done) return done;
  if (streams.timed()) {
    if (auto done = streams.times.write(rows.times.data(), count * 16, first * 16); !done) return done;
  }
  return streams.records.write(rows.records.data(), count * 8, first * 8);
}

}  // namespace comap
