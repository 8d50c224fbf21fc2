#include <turbojpeg.h>

#include <memory>

#include "edge_agent/capture/image_codec.h"
#include "edge_agent/capture/image_file.h"

namespace comap::codec_detail {
namespace {

struct Destroy {
  void operator()(void* handle) const { tjDestroy(handle); }
};
using Handle = std::unique_ptr<void, Destroy>;

struct Free {
  void operator()(unsigned char* bytes) const { tjFree(bytes); }
};

Error damaged(const std::string& name, const Handle& handle) {
  return {ErrorCode::kBadData, name + ": is a truncated or damaged JPEG: " + tjGetErrorStr2(handle.get())};
}

}  // namespace

Result<ColourImage> decodeJpeg(Bytes bytes, const std::string& name) {
  Handle handle(tjInitDecompress());
  if (!handle) return Error{ErrorCode::kOutOfMemory, name + ": no JPEG decoder: " + tjGetErrorStr()};
  int width = 0, height = 0, subsampling = 0, colour_space = 0;
  if (tjDecompressHeader3(handle.get(), bytes.data(), bytes.size(), &width, &height, &subsampling, &colour_space) !=
      0) {
    return damaged(name, handle);
  }
  if (auto size = checkSize(static_cast<uint64_t>(width), static_cast<uint64_t>(height), name); !size) {
    return size.error();
  }
  ColourImage image(width, height);
  static_assert(sizeof(Rgb) == 3);
  // A truncated stream is only a warning to the library, which fills the rest with grey; here it is damage.
  if (tjDecompress2(handle.get(), bytes.data(), bytes.size(), &image.data()->r, width, 0, height, TJPF_RGB,
                    TJFLAG_ACCURATEDCT) != 0) {
    return damaged(name, handle);
  }
  return image;
}

Result<std::vector<uint8_t>> encodeJpeg(const ColourImage& image, int quality, const std::string& name) {
  if (image.empty() || quality < 1 || quality > 100) {
    return Error{ErrorCode::kWrongUse, name + ": cannot be written as JPEG of quality " + std::to_string(quality) +
                                           " from a picture of " + std::to_string(image.size()) + " pixels"};
  }
  Handle handle(tjInitCompress());
  if (!handle) return Error{ErrorCode::kOutOfMemory, name + ": no JPEG encoder: " + tjGetErrorStr()};
  unsigned char* raw = nullptr;
  unsigned long size = 0;
  const int subsampling = quality < 90 ? TJSAMP_420 : TJSAMP_444;
  const int failed = tjCompress2(handle.get(), &image.data()->r, image.width(), 0, image.height(), TJPF_RGB, &raw,
                                 &size, subsampling, quality, TJFLAG_ACCURATEDCT);
  std::unique_ptr<unsigned char, Free> owned(raw);
  if (failed != 0) return Error{ErrorCode::kProblem, name + ": JPEG encoding failed: " + tjGetErrorStr2(handle.get())};
  return std::vector<uint8_t>(raw, raw + size);
}

}  // namespace comap::codec_detail
