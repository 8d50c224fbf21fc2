#include "edge_agent/capture/camera_source.h"

#include <cstring>

#include "edge_agent/capture/paired_source.h"

namespace comap {
namespace {

struct StreamName {
  std::string scheme, place;
};

// One of the two streams of a pair: its scheme may be left out where the pair's own tells it.
Result<StreamName> parseStream(const std::string& text) {
  const size_t colon = text.find(':');
  if (colon == std::string::npos) return Error{ErrorCode::kWrongUse, "stream '" + text + "' is not SCHEME:PLACE"};
  StreamName name{text.substr(0, colon), text.substr(colon + 1)};
  if (name.scheme != "v4l2")
    return Error{ErrorCode::kWrongUse, "stream '" + text + "': scheme '" + name.scheme + "' gives no single stream"};
  if (name.place.empty()) return Error{ErrorCode::kWrongUse, "stream '" + text + "' names no device"};
  return name;
}

StreamOpener v4l2Opener(VideoCalls& calls, const std::string& path, PictureKind kind, const CameraConfig& config) {
  const bool colour = kind == PictureKind::kColour;
  const CameraModel& pinhole = (colour ? config.rig.colour : config.rig.depth).pinhole;
  VideoWish wish{kind, colour ? config.colour_format : config.depth_format, pinhole.width, pinhole.height, config.fps};
  if (!colour && config.registration == "device") {
    wish.width = config.rig.colour.pinhole.width;
    wish.height = config.rig.colour.pinhole.height;
  }
  const VideoControls controls = colour ? config.colour_controls : config.depth_controls;
  return [&calls, path, wish, controls] { return openV4l2(calls, path, wish, controls); };
}

PairedOptions pairedOptions(const CameraConfig& config, CaptureLog log) {
  PairedOptions options;
  options.rig = config.rig;
  options.depth_is_registered = config.registration == "device";
  options.shrink = config.shrink;
  options.max_gap_ns = int64_t{config.pair_gap_ms} * 1'000'000;
  options.log = std::move(log);
  return options;
}

}  // namespace

bool isCameraScheme(const std::string& scheme) { return scheme == "v4l2" || scheme == "pair"; }

Result<std::unique_ptr<FrameSource>> openCamera(const std::string& scheme, const std::string& place,
                                                const CameraConfig& config, CaptureLog log, VideoCalls& calls) {
  const size_t comma = place.find(',');
  if (comma == std::string::npos || comma == 0 || comma + 1 == place.size())
    return Error{ErrorCode::kWrongUse, scheme + ":" + place + " does not name two streams, as " + scheme +
                                           (scheme == "pair" ? ":COLOUR_URI,DEPTH_URI" : ":COLOUR,DEPTH")};
  const std::string prefix = scheme == "pair" ? std::string() : scheme + ":";
  auto colour = parseStream(prefix + place.substr(0, comma));
  if (!colour) return colour.error();
  auto depth = parseStream(prefix + place.substr(comma + 1));
  if (!depth) return depth.error();
  if (colour->place == depth->place)
    return Error{ErrorCode::kWrongUse, scheme + ":" + place + " names one device for both colour and depth"};
  return openPaired(v4l2Opener(calls, colour->place, PictureKind::kColour, config),
                    v4l2Opener(calls, depth->place, PictureKind::kDepth, config),
                    pairedOptions(config, std::move(log)));
}

std::vector<std::string> cameraSchemes() {
  return {"v4l2:COLOUR,DEPTH (two device files of a camera, such as v4l2:/dev/video2,/dev/video0)",
          "pair:COLOUR_URI,DEPTH_URI (any colour stream with any depth stream, such as "
          "pair:v4l2:/dev/video4,v4l2:/dev/video0)"};
}

std::vector<std::string> camerasFound(VideoCalls& calls) {
  std::vector<std::string> lines;
  for (const std::string& path : calls.nodes()) {
    const int descriptor = calls.open(path);
    if (descriptor < 0) {
      lines.push_back("v4l2 " + path + ": cannot be opened: " + std::strerror(-descriptor));
      continue;
    }
    const auto offer = askOffer(calls, descriptor, path);
    calls.close(descriptor);
    if (!offer) {
      lines.push_back("v4l2 " + offer.error().text);
      continue;
    }
    lines.push_back("v4l2 " + path + ": " + offer->card + " (" + offer->bus + ")");
    for (const VideoMode& mode : offer->modes)
      lines.push_back("  " + toString(mode) + (mode.format ? "" : " (not understood here)"));
  }
  return lines;
}

}  // namespace comap
