// The formats behind image_file.h, from and to memory; for this folder's own use.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "protocol/types/image.h"
#include "protocol/types/result.h"

namespace comap::codec_detail {

using Bytes = std::span<const uint8_t>;

/// `name` is the file's, for error texts.
Result<ColourImage> decodeColourPng(Bytes bytes, const std::string& name);
Result<DepthImage> decodeDepthPng(Bytes bytes, const std::string& name);
Result<ColourImage> decodeJpeg(Bytes bytes, const std::string& name);

Result<std::vector<uint8_t>> encodeJpeg(const ColourImage& image, int quality, const std::string& name);

/// kBadData if a picture of this size is refused, before memory is taken for it.
Result<void> checkSize(uint64_t width, uint64_t height, const std::string& name);

}  // namespace comap::codec_detail
