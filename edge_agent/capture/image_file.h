// Colour and depth pictures on disk: JPEG and PNG. Files are untrusted: sizes are checked before memory is taken.
#pragma once

#include <string>

#include "protocol/types/image.h"
#include "protocol/types/result.h"

namespace comap {

/// The largest picture read, in each direction.
inline constexpr int kMaxImageEdge_px = 8192;

/// A colour picture, PNG or JPEG as its first bytes say; grey becomes RGB, alpha is dropped, 16 bits become 8.
/// kUnreachable if the file cannot be read, kBadData if it is truncated, damaged, too large or another format.
Result<ColourImage> readColour(const std::string& path);

/// A 16-bit grey PNG, values as stored (their unit is the caller's knowledge). Errors as readColour; a PNG of another
/// depth or colour type is kBadData.
Result<DepthImage> readDepth16(const std::string& path);

/// Writes 8-bit RGB. kUnreachable if the file cannot be written.
Result<void> writeColourPng(const std::string& path, const ColourImage& image);

/// Writes JPEG, quality 1-100, 4:2:0 chroma below quality 90 and 4:4:4 from there. kUnreachable if it cannot.
Result<void> writeColourJpeg(const std::string& path, const ColourImage& image, int quality);

/// Writes 16-bit grey, values as given. kUnreachable if the file cannot be written.
Result<void> writeDepth16Png(const std::string& path, const DepthImage& image);

}  // namespace comap
