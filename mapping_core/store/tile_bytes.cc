#include "mapping_core/store/tile_bytes.h"

#include <zstd.h>

#include <cassert>
#include <memory>

namespace comap {
namespace {

constexpr int kLevel = 3;

void put(const TileSurfel& s, uint8_t* out) {
  const uint16_t position[3] = {s.x, s.y, s.z};
  for (const uint16_t value : position) {
    *out++ = static_cast<uint8_t>(value & 0xff);
    *out++ = static_cast<uint8_t>(value >> 8);
  }
  for (const uint8_t value : {s.normal_u, s.normal_v, s.r, s.g, s.b, s.log_radius, s.confidence, s.contributors}) {
    *out++ = value;
  }
}

TileSurfel take(const uint8_t* in) {
  const auto u16 = [&](int i) { return static_cast<uint16_t>(in[i] | in[i + 1] << 8); };
  return {u16(0), u16(2), u16(4), in[6], in[7], in[8], in[9], in[10], in[11], in[12], in[13]};
}

Error damaged(const std::string& what) { return {ErrorCode::kBadData, "tile is damaged: " + what}; }

}  // namespace

std::vector<uint8_t> compressSurfels(std::span<const TileSurfel> surfels) {
  assert(surfels.size() <= kMaxStoredTileSurfels);
  std::vector<uint8_t> raw(surfels.size() * kTileSurfelBytes);
  for (size_t i = 0; i < surfels.size(); ++i) put(surfels[i], raw.data() + i * kTileSurfelBytes);

  const std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> context(ZSTD_createCCtx(), &ZSTD_freeCCtx);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, kLevel);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, 1);
  std::vector<uint8_t> frame(ZSTD_compressBound(raw.size()));
  const size_t size = ZSTD_compress2(context.get(), frame.data(), frame.size(), raw.data(), raw.size());
  assert(!ZSTD_isError(size));  // the output is large enough by construction
  frame.resize(size);
  return frame;
}

Result<std::vector<TileSurfel>> decompressSurfels(std::span<const uint8_t> frame, int64_t count) {
  if (count < 0 || static_cast<uint64_t>(count) > kMaxStoredTileSurfels) {
    return damaged("it claims " + std::to_string(count) + " surfels, expected 0 to " +
                   std::to_string(kMaxStoredTileSurfels));
  }
  const size_t size = static_cast<size_t>(count) * kTileSurfelBytes;
  const unsigned long long claimed = ZSTD_getFrameContentSize(frame.data(), frame.size());
  if (claimed != size) {
    return damaged(claimed == ZSTD_CONTENTSIZE_ERROR || claimed == ZSTD_CONTENTSIZE_UNKNOWN
                       ? "no zstd frame of known size"
                       : "it holds " + std::to_string(claimed) + " bytes, expected " + std::to_string(size));
  }
  std::vector<uint8_t> raw(size);
  const size_t got = ZSTD_decompress(raw.data(), raw.size(), frame.data(), frame.size());
  if (ZSTD_isError(got)) return damaged(ZSTD_getErrorName(got));
  if (got != size) return damaged("its frame is short");
  std::vector<TileSurfel> surfels(static_cast<size_t>(count));
  for (size_t i = 0; i < surfels.size(); ++i) surfels[i] = take(raw.data() + i * kTileSurfelBytes);
  return surfels;
}

}  // namespace comap
