#include "edge_agent/capture/picture_convert.h"

#include <algorithm>
#include <cstring>

#include "edge_agent/capture/image_codec.h"

namespace comap {
namespace {

std::string sizeText(int width, int height) { return std::to_string(width) + "x" + std::to_string(height); }

Error tooShort(const Picture& picture, size_t needed) {
  return {ErrorCode::kBadData, toString(picture.format) + " picture of " + sizeText(picture.width, picture.height) +
                                   " has " + std::to_string(picture.bytes.size()) + " bytes, " +
                                   std::to_string(needed) + " expected"};
}

// Rows of `row_bytes` used bytes, `rows` of them; the last row may end without padding.
Result<void> checkPlane(const Picture& picture, size_t row_bytes, size_t rows) {
  if (auto size = codec_detail::checkSize(static_cast<uint64_t>(std::max(picture.width, 0)),
                                          static_cast<uint64_t>(std::max(picture.height, 0)),
                                          toString(picture.format) + " picture");
      !size)
    return size;
  if (picture.stride_bytes < 0 || static_cast<size_t>(picture.stride_bytes) < row_bytes)
    return Error{ErrorCode::kBadData, toString(picture.format) + " picture has rows of " +
                                          std::to_string(picture.stride_bytes) + " bytes, at least " +
                                          std::to_string(row_bytes) + " expected"};
  const size_t needed = static_cast<size_t>(picture.stride_bytes) * (rows - 1) + row_bytes;
  if (picture.bytes.size() < needed) return tooShort(picture, needed);
  return {};
}

uint8_t clampByte(int value) { return static_cast<uint8_t>(std::clamp(value, 0, 255)); }

// BT.601 in 16-bit fixed point: what one chroma pair adds to each channel, and how Y is scaled.
class YuvRow {
 public:
  explicit YuvRow(bool full_range) : full_(full_range) {}
  void chroma(int u, int v) {
    u -= 128;
    v -= 128;
    red_ = full_ ? 91881 * v : 104597 * v;
    green_ = full_ ? -22554 * u - 46802 * v : -25675 * u - 53279 * v;
    blue_ = full_ ? 116130 * u : 132201 * u;
  }
  Rgb pixel(int y) const {
    const int scaled = (full_ ? y * 65536 : (y - 16) * 76309) + 32768;
    return {clampByte((scaled + red_) >> 16), clampByte((scaled + green_) >> 16), clampByte((scaled + blue_) >> 16)};
  }

 private:
  bool full_;
  int red_ = 0, green_ = 0, blue_ = 0;
};

Result<ColourImage> fromYuyv(const Picture& picture) {
  if (picture.width % 2 != 0)
    return Error{ErrorCode::kBadData,
                 "YUYV picture is " + std::to_string(picture.width) + " pixels wide, expected even"};
  if (auto plane = checkPlane(picture, static_cast<size_t>(picture.width) * 2, static_cast<size_t>(picture.height));
      !plane)
    return plane.error();
  ColourImage image(picture.width, picture.height);
  YuvRow yuv(picture.full_range);
  for (int y = 0; y < picture.height; ++y) {
    const uint8_t* in = picture.bytes.data() + static_cast<size_t>(y) * static_cast<size_t>(picture.stride_bytes);
    Rgb* out = image.row(y);
    for (int x = 0; x < picture.width; x += 2, in += 4) {
      yuv.chroma(in[1], in[3]);
      out[x] = yuv.pixel(in[0]);
      out[x + 1] = yuv.pixel(in[2]);
    }
  }
  return image;
}

Result<ColourImage> fromNv12(const Picture& picture) {
  if (picture.width % 2 != 0 || picture.height % 2 != 0)
    return Error{ErrorCode::kBadData,
                 "NV12 picture is " + sizeText(picture.width, picture.height) + " pixels, expected even"};
  if (auto plane = checkPlane(picture, static_cast<size_t>(picture.width),
                              static_cast<size_t>(picture.height) + static_cast<size_t>(picture.height) / 2);
      !plane)
    return plane.error();
  const size_t stride = static_cast<size_t>(picture.stride_bytes);
  const uint8_t* chroma = picture.bytes.data() + stride * static_cast<size_t>(picture.height);
  ColourImage image(picture.width, picture.height);
  YuvRow yuv(picture.full_range);
  for (int y = 0; y < picture.height; ++y) {
    const uint8_t* luma = picture.bytes.data() + stride * static_cast<size_t>(y);
    const uint8_t* uv = chroma + stride * static_cast<size_t>(y / 2);
    Rgb* out = image.row(y);
    for (int x = 0; x < picture.width; x += 2) {
      yuv.chroma(uv[x], uv[x + 1]);
      out[x] = yuv.pixel(luma[x]);
      out[x + 1] = yuv.pixel(luma[x + 1]);
    }
  }
  return image;
}

Result<ColourImage> fromRgb(const Picture& picture, bool swapped) {
  if (auto plane = checkPlane(picture, static_cast<size_t>(picture.width) * 3, static_cast<size_t>(picture.height));
      !plane)
    return plane.error();
  ColourImage image(picture.width, picture.height);
  for (int y = 0; y < picture.height; ++y) {
    const uint8_t* in = picture.bytes.data() + static_cast<size_t>(y) * static_cast<size_t>(picture.stride_bytes);
    Rgb* out = image.row(y);
    for (int x = 0; x < picture.width; ++x, in += 3)
      out[x] = swapped ? Rgb{in[2], in[1], in[0]} : Rgb{in[0], in[1], in[2]};
  }
  return image;
}

Result<ColourImage> fromMjpeg(const Picture& picture) {
  auto image = codec_detail::decodeJpeg(picture.bytes, "MJPG picture");
  if (!image) return image;
  if (image->width() != picture.width || image->height() != picture.height)
    return Error{ErrorCode::kBadData, "MJPG picture is " + sizeText(image->width(), image->height()) + " pixels, " +
                                          sizeText(picture.width, picture.height) + " expected"};
  return image;
}

}  // namespace

std::string toString(PixelFormat format) {
  switch (format) {
    case PixelFormat::kMjpeg:
      return "MJPG";
    case PixelFormat::kYuyv:
      return "YUYV";
    case PixelFormat::kNv12:
      return "NV12";
    case PixelFormat::kRgb3:
      return "RGB3";
    case PixelFormat::kBgr3:
      return "BGR3";
    case PixelFormat::kZ16:
      return "Z16";
    case PixelFormat::kInzi:
      return "INZI";
    case PixelFormat::kY16:
      return "Y16";
  }
  return "?";
}

Result<ColourImage> toColour(const Picture& picture) {
  switch (picture.format) {
    case PixelFormat::kMjpeg:
      return fromMjpeg(picture);
    case PixelFormat::kYuyv:
      return fromYuyv(picture);
    case PixelFormat::kNv12:
      return fromNv12(picture);
    case PixelFormat::kRgb3:
      return fromRgb(picture, false);
    case PixelFormat::kBgr3:
      return fromRgb(picture, true);
    default:
      return Error{ErrorCode::kWrongUse, toString(picture.format) + " is no colour format"};
  }
}

Result<DepthImage> toDepthValues(const Picture& picture) {
  const bool two_planes = picture.format == PixelFormat::kInzi;
  if (!two_planes && picture.format != PixelFormat::kZ16 && picture.format != PixelFormat::kY16)
    return Error{ErrorCode::kWrongUse, toString(picture.format) + " is no depth format"};
  const size_t height = static_cast<size_t>(std::max(picture.height, 0));
  const size_t row_bytes = static_cast<size_t>(std::max(picture.width, 0)) * 2;
  if (auto plane = checkPlane(picture, row_bytes, two_planes ? 2 * height : height); !plane) return plane.error();
  const size_t stride = static_cast<size_t>(picture.stride_bytes);
  const uint8_t* first = picture.bytes.data() + (two_planes ? stride * height : 0);
  DepthImage image(picture.width, picture.height);
  for (int y = 0; y < picture.height; ++y) {
    const uint8_t* in = first + stride * static_cast<size_t>(y);
    uint16_t* out = image.row(y);
    for (int x = 0; x < picture.width; ++x) out[x] = static_cast<uint16_t>(in[2 * x] | in[2 * x + 1] << 8);
  }
  return image;
}

}  // namespace comap
