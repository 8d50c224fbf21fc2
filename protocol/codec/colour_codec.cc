#include "protocol/codec/colour_codec.h"

#include <turbojpeg.h>

#include <memory>
#include <string>

#include "protocol/codec/limits.h"

namespace comap {
namespace {

static_assert(sizeof(Rgb) == 3, "pixels are handed to libjpeg-turbo as they lie");

struct Destroy {
  void operator()(void* handle) const { tjDestroy(handle); }
};
using Handle = std::unique_ptr<void, Destroy>;

bool sidesAllowed(int width, int height) {
  return width >= kMinImageSide && height >= kMinImageSide && width <= kMaxImageSide && height <= kMaxImageSide;
}

std::string sides(int width, int height) { return std::to_string(width) + "x" + std::to_string(height); }

}  // namespace

Result<std::vector<uint8_t>> encodeColour(const ColourImage& image, int quality) {
  if (quality < 1 || quality > 100) {
    return Error{ErrorCode::kWrongUse, "colour: quality " + std::to_string(quality) + ", expected 1 to 100"};
  }
  if (!sidesAllowed(image.width(), image.height())) {
    return Error{ErrorCode::kWrongUse, "colour: " + sides(image.width(), image.height()) +
                                           " pixels, expected sides of " + std::to_string(kMinImageSide) + " to " +
                                           std::to_string(kMaxImageSide)};
  }
  const Handle handle(tjInitCompress());
  if (!handle) return Error{ErrorCode::kOutOfMemory, "colour: no JPEG compressor: out of memory"};
  std::vector<uint8_t> bytes(tjBufSize(image.width(), image.height(), TJSAMP_420));
  unsigned char* out = bytes.data();
  unsigned long size = bytes.size();
  const auto* pixels = reinterpret_cast<const unsigned char*>(image.data());
  if (tjCompress2(handle.get(), pixels, image.width(), 3 * image.width(), image.height(), TJPF_RGB, &out, &size,
                  TJSAMP_420, quality, TJFLAG_NOREALLOC) != 0) {
    return Error{ErrorCode::kWrongUse, std::string("colour: ") + tjGetErrorStr2(handle.get())};
  }
  bytes.resize(size);
  return bytes;
}

Result<ColourImage> decodeColour(std::span<const uint8_t> bytes, int width, int height) {
  if (!sidesAllowed(width, height)) {
    return Error{ErrorCode::kBadData, "colour: " + sides(width, height) + " pixels expected, beyond the limits"};
  }
  const Handle handle(tjInitDecompress());
  if (!handle) return Error{ErrorCode::kOutOfMemory, "colour: no JPEG decompressor: out of memory"};
  int found_width = 0, found_height = 0, subsampling = 0, colour_space = 0;
  if (tjDecompressHeader3(handle.get(), bytes.data(), bytes.size(), &found_width, &found_height, &subsampling,
                          &colour_space) != 0) {
    return Error{ErrorCode::kBadData, std::string("colour: no JPEG: ") + tjGetErrorStr2(handle.get())};
  }
  if (found_width != width || found_height != height) {
    return Error{ErrorCode::kBadData,
                 "colour: JPEG of " + sides(found_width, found_height) + " pixels, expected " + sides(width, height)};
  }
  ColourImage image(width, height);
  // A damaged JPEG is refused, not patched up; a progressive one may not repeat scans without end.
  if (tjDecompress2(handle.get(), bytes.data(), bytes.size(), reinterpret_cast<unsigned char*>(image.data()), width,
                    3 * width, height, TJPF_RGB, TJFLAG_ACCURATEDCT | TJFLAG_STOPONWARNING | TJFLAG_LIMITSCANS) != 0) {
    return Error{ErrorCode::kBadData, std::string("colour: damaged JPEG: ") + tjGetErrorStr2(handle.get())};
  }
  return image;
}

}  // namespace comap
