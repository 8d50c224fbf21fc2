#include "edge_agent/capture/v4l2_format.h"

#include <linux/videodev2.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

namespace comap {
namespace {

constexpr uint32_t kMostEntries = 1000;  // a driver that never says "no more" is not followed for ever
constexpr double kRateTolerance = 0.95;

struct Known {
  PixelFormat format;
  uint32_t fourcc;
  PictureKind kind;
};
// In order of preference: pictures that cost nothing to decode before those that do.
constexpr std::array kKnown{
    Known{PixelFormat::kYuyv, V4L2_PIX_FMT_YUYV, PictureKind::kColour},
    Known{PixelFormat::kNv12, V4L2_PIX_FMT_NV12, PictureKind::kColour},
    Known{PixelFormat::kRgb3, V4L2_PIX_FMT_RGB24, PictureKind::kColour},
    Known{PixelFormat::kBgr3, V4L2_PIX_FMT_BGR24, PictureKind::kColour},
    Known{PixelFormat::kMjpeg, V4L2_PIX_FMT_MJPEG, PictureKind::kColour},
    Known{PixelFormat::kZ16, V4L2_PIX_FMT_Z16, PictureKind::kDepth},
    Known{PixelFormat::kInzi, V4L2_PIX_FMT_INZI, PictureKind::kDepth},
    Known{PixelFormat::kY16, V4L2_PIX_FMT_Y16, PictureKind::kDepth},
};

std::string text(const unsigned char* bytes, size_t size) {
  const char* start = reinterpret_cast<const char*>(bytes);
  std::string found(start, strnlen(start, size));
  for (char& c : found)
    if (static_cast<unsigned char>(c) < 0x20 || static_cast<unsigned char>(c) >= 0x7f) c = '?';
  return found;
}

std::string fourccText(uint32_t fourcc) {
  const unsigned char bytes[4] = {static_cast<unsigned char>(fourcc), static_cast<unsigned char>(fourcc >> 8),
                                  static_cast<unsigned char>(fourcc >> 16),
                                  static_cast<unsigned char>(fourcc >> 24 & 0x7f)};
  std::string name = text(bytes, 4);
  while (!name.empty() && name.back() == ' ') name.pop_back();
  return (fourcc & 1u << 31) != 0 ? name + "-BE" : name;  // as the kernel names big-endian ones
}

double fastest(VideoCalls& calls, int descriptor, uint32_t fourcc, uint32_t width, uint32_t height) {
  double best = 0;
  for (uint32_t i = 0; i < kMostEntries; ++i) {
    v4l2_frmivalenum interval{};
    interval.index = i;
    interval.pixel_format = fourcc;
    interval.width = width;
    interval.height = height;
    if (calls.control(descriptor, VIDIOC_ENUM_FRAMEINTERVALS, &interval) != 0) break;
    const bool discrete = interval.type == V4L2_FRMIVAL_TYPE_DISCRETE;
    const v4l2_fract& shortest = discrete ? interval.discrete : interval.stepwise.min;
    if (shortest.numerator > 0) best = std::max(best, static_cast<double>(shortest.denominator) / shortest.numerator);
    if (!discrete) break;
  }
  return best;
}

void askSizes(VideoCalls& calls, int descriptor, uint32_t fourcc, std::vector<VideoMode>& modes) {
  for (uint32_t i = 0; i < kMostEntries && modes.size() < kMostEntries; ++i) {
    v4l2_frmsizeenum size{};
    size.index = i;
    size.pixel_format = fourcc;
    if (calls.control(descriptor, VIDIOC_ENUM_FRAMESIZES, &size) != 0) break;
    const bool discrete = size.type == V4L2_FRMSIZE_TYPE_DISCRETE;
    VideoMode mode;
    mode.fourcc = fourcc;
    mode.format = formatOf(fourcc);
    mode.width = static_cast<int>(discrete ? size.discrete.width : size.stepwise.max_width);
    mode.height = static_cast<int>(discrete ? size.discrete.height : size.stepwise.max_height);
    mode.min_width = discrete ? mode.width : static_cast<int>(size.stepwise.min_width);
    mode.min_height = discrete ? mode.height : static_cast<int>(size.stepwise.min_height);
    mode.max_fps =
        fastest(calls, descriptor, fourcc, static_cast<uint32_t>(mode.width), static_cast<uint32_t>(mode.height));
    modes.push_back(mode);
    if (!discrete) break;
  }
}

bool fits(const VideoMode& mode, const VideoWish& wish) {
  const auto within = [](int wanted, int low, int high) { return wanted == 0 || (wanted >= low && wanted <= high); };
  return within(wish.width, mode.min_width, mode.width) && within(wish.height, mode.min_height, mode.height);
}

}  // namespace

std::optional<PixelFormat> formatOf(uint32_t fourcc) {
  if (fourcc == V4L2_PIX_FMT_JPEG) return PixelFormat::kMjpeg;
  for (const Known& known : kKnown)
    if (known.fourcc == fourcc) return known.format;
  return std::nullopt;
}

std::string toString(const VideoMode& mode) {
  std::string line = fourccText(mode.fourcc) + fmt::format(" {}x{}", mode.width, mode.height);
  if (mode.min_width != mode.width || mode.min_height != mode.height)
    line = fourccText(mode.fourcc) +
           fmt::format(" {}x{} to {}x{}", mode.min_width, mode.min_height, mode.width, mode.height);
  if (mode.max_fps > 0) line += fmt::format(" {:.4g} fps", mode.max_fps);
  return line;
}

Result<VideoOffer> askOffer(VideoCalls& calls, int descriptor, const std::string& path) {
  v4l2_capability capability{};
  if (const int failed = calls.control(descriptor, VIDIOC_QUERYCAP, &capability); failed != 0) {
    if (failed == -ENOTTY || failed == -EINVAL) return Error{ErrorCode::kWrongUse, path + ": is no video device"};
    return Error{ErrorCode::kUnreachable, path + ": does not answer: " + std::strerror(-failed)};
  }
  const uint32_t can =
      (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps : capability.capabilities;
  VideoOffer offer{path,
                   text(capability.card, sizeof capability.card),
                   text(capability.bus_info, sizeof capability.bus_info),
                   (can & V4L2_CAP_VIDEO_CAPTURE) == 0,
                   {},
                   {}};
  if ((can & (V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_VIDEO_CAPTURE_MPLANE)) == 0)
    return Error{ErrorCode::kWrongUse, path + " (" + offer.card + "): gives no pictures"};
  if ((can & V4L2_CAP_STREAMING) == 0)
    return Error{ErrorCode::kWrongUse, path + " (" + offer.card + "): does not stream, only reads"};
  for (uint32_t i = 0; i < kMostEntries; ++i) {
    v4l2_fmtdesc description{};
    description.index = i;
    description.type = offer.multi_plane ? V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE : V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (calls.control(descriptor, VIDIOC_ENUM_FMT, &description) != 0) break;
    if (formatOf(description.pixelformat)) {
      askSizes(calls, descriptor, description.pixelformat, offer.modes);
    } else {
      offer.other_formats.push_back(fourccText(description.pixelformat));
    }
  }
  return offer;
}

Result<VideoMode> chooseMode(const VideoOffer& offer, const VideoWish& wish) {
  const VideoMode* best = nullptr;
  bool best_in_time = false;
  for (const Known& known : kKnown) {
    if (known.kind != wish.kind || (wish.format != "auto" && wish.format != toString(known.format))) continue;
    for (const VideoMode& mode : offer.modes) {
      if (mode.format != known.format || !fits(mode, wish)) continue;
      const bool in_time = mode.max_fps <= 0 || mode.max_fps >= wish.fps * kRateTolerance;
      if (best == nullptr || (in_time && !best_in_time) || (!best_in_time && mode.max_fps > best->max_fps)) {
        best = &mode;
        best_in_time = in_time;
      }
    }
  }
  if (best != nullptr) {
    VideoMode chosen = *best;
    if (wish.width != 0) chosen.width = wish.width;
    if (wish.height != 0) chosen.height = wish.height;
    return chosen;
  }
  std::string offered;
  for (const VideoMode& mode : offer.modes) offered += (offered.empty() ? "" : ", ") + toString(mode);
  for (const std::string& other : offer.other_formats) offered += (offered.empty() ? "" : ", ") + other;
  const std::string size = wish.width == 0 ? std::string() : fmt::format(" of {}x{}", wish.width, wish.height);
  return Error{ErrorCode::kWrongUse, offer.path + " (" + offer.card + "): offers no " +
                                         (wish.kind == PictureKind::kColour ? "colour" : "depth") + " pictures" + size +
                                         (wish.format == "auto" ? std::string() : " as " + wish.format) +
                                         "; it offers: " + (offered.empty() ? "nothing" : offered)};
}

}  // namespace comap
