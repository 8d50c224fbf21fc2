#include "protocol/codec/section.h"

#include <zstd.h>

#include <cassert>

namespace comap::codec {

std::vector<uint8_t> compress(std::span<const uint8_t> raw, int level) {
  std::vector<uint8_t> packed(ZSTD_compressBound(raw.size()));
  const size_t size = ZSTD_compress(packed.data(), packed.size(), raw.data(), raw.size(), level);
  assert(!ZSTD_isError(size));
  packed.resize(size);
  return packed;
}

Result<std::vector<uint8_t>> decompress(std::span<const uint8_t> packed, size_t raw_size, const std::string& name) {
  const unsigned long long claimed = ZSTD_getFrameContentSize(packed.data(), packed.size());
  if (claimed == ZSTD_CONTENTSIZE_ERROR || claimed == ZSTD_CONTENTSIZE_UNKNOWN || claimed != raw_size) {
    return Error{ErrorCode::kBadData, name + " is no zstd frame of " + std::to_string(raw_size) + " bytes"};
  }
  std::vector<uint8_t> raw(raw_size);
  const size_t size = ZSTD_decompress(raw.data(), raw.size(), packed.data(), packed.size());
  if (ZSTD_isError(size) || size != raw_size) {
    return Error{ErrorCode::kBadData,
                 name + " does not decompress: " + (ZSTD_isError(size) ? ZSTD_getErrorName(size) : "too short")};
  }
  return raw;
}

}  // namespace comap::codec
