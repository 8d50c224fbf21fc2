// What a camera delivers, before anything is made of it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace comap {

enum class PictureKind : uint8_t { kColour, kDepth };

enum class PixelFormat : uint8_t {
  kMjpeg,  ///< one JPEG; its Huffman tables may be left out, as cameras do
  kYuyv,   ///< Y U Y V, chroma for two pixels
  kNv12,   ///< plane of Y, then plane of U V pairs for blocks of 2x2
  kRgb3,   ///< R G B
  kBgr3,   ///< B G R
  kZ16,    ///< depth, 16 bits, low byte first
  kInzi,   ///< plane of 16-bit infrared, then plane of 16-bit depth
  kY16,    ///< 16-bit grey, low byte first, which some cameras call their depth
};

/// As it is written in configurations: "MJPG", "YUYV", "NV12", "RGB3", "BGR3", "Z16", "INZI", "Y16".
std::string toString(PixelFormat format);

struct Picture {
  PixelFormat format = PixelFormat::kYuyv;
  int width = 0, height = 0;  ///< pixels
  int stride_bytes = 0;       ///< from row to row (of the first plane); not used for kMjpeg
  bool full_range = false;    ///< Y from 0 to 255 instead of 16 to 235
  int64_t stamp_ns = 0;       ///< host's monotonic clock; 0 = the device does not say
  uint64_t sequence = 0;      ///< of the device's own count, which also counts pictures that never came
  std::vector<uint8_t> bytes;
};

}  // namespace comap
