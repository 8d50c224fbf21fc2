// What a video device offers, and which of it to take.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "edge_agent/capture/picture_stream.h"
#include "edge_agent/capture/video_calls.h"
#include "protocol/types/result.h"

namespace comap {

/// One size of one format that is understood here. A device that offers a range of sizes is listed with its largest.
struct VideoMode {
  uint32_t fourcc = 0;
  std::optional<PixelFormat> format;
  int width = 0, height = 0;
  int min_width = 0, min_height = 0;  ///< less than width, height where sizes are a range
  double max_fps = 0;                 ///< 0 = not told
};

struct VideoOffer {
  std::string path, card, bus;
  bool multi_plane = false;  ///< spoken with through the interface for pictures in several planes; of these it has one
  std::vector<VideoMode> modes;
  std::vector<std::string> other_formats;  ///< names of those that are not understood here
};

/// Asks an open device. kWrongUse if it does not capture pictures, kUnreachable if it does not answer.
Result<VideoOffer> askOffer(VideoCalls& calls, int descriptor, const std::string& path);

/// The best mode: the wanted format, else the first of YUYV, NV12, RGB3, BGR3, MJPG (Z16, INZI, Y16 for depth) that
/// comes at the wanted rate, else the fastest. kWrongUse names what is offered if nothing fits.
Result<VideoMode> chooseMode(const VideoOffer& offer, const VideoWish& wish);

/// "YUYV 640x480 30 fps".
std::string toString(const VideoMode& mode);

/// The format that the kernel calls so; nothing if it is not understood here.
std::optional<PixelFormat> formatOf(uint32_t fourcc);

}  // namespace comap
