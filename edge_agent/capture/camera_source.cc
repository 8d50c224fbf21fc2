#include "edge_agent/capture/camera_source.h"

#include <cstring>
#include <filesystem>

#include "edge_agent/capture/libcamera.h"
#include "edge_agent/capture/openni2.h"
#include "edge_agent/capture/paired_source.h"
#include "edge_agent/capture/v4l2_format.h"
#include "edge_agent/capture/v4l2_stream.h"

namespace comap {
namespace {

struct StreamName {
  std::string scheme, place;
};

// One of the two streams of a pair.
Result<StreamName> parseStream(const std::string& text) {
  const size_t colon = text.find(':');
  if (colon == std::string::npos) return Error{ErrorCode::kWrongUse, "stream '" + text + "' is not SCHEME:PLACE"};
  return StreamName{text.substr(0, colon), text.substr(colon + 1)};
}

VideoWish wishOf(PictureKind kind, const CameraConfig& config) {
  const bool colour = kind == PictureKind::kColour;
  const CameraModel& pinhole = (colour ? config.rig.colour : config.rig.depth).pinhole;
  VideoWish wish{kind, colour ? config.colour_format : config.depth_format, pinhole.width, pinhole.height, config.fps};
  if (!colour && config.registration == "device") {
    wish.width = config.rig.colour.pinhole.width;
    wish.height = config.rig.colour.pinhole.height;
  }
  return wish;
}

Result<StreamOpener> openerOf(VideoCalls& calls, const StreamName& name, PictureKind kind, const CameraConfig& config) {
  const std::string text = name.scheme + ":" + name.place;
  const VideoWish wish = wishOf(kind, config);
  const VideoControls controls = kind == PictureKind::kColour ? config.colour_controls : config.depth_controls;
  if (name.scheme == "openni2") return openOpenNi2Stream(name.place, kind, config);
  if (name.scheme == "libcamera")
    return StreamOpener([id = name.place, wish, controls] { return openLibcamera(id, wish, controls); });
  if (name.scheme != "v4l2")
    return Error{ErrorCode::kWrongUse, "stream '" + text + "': scheme '" + name.scheme + "' gives no single stream"};
  if (name.place.empty()) return Error{ErrorCode::kWrongUse, "stream '" + text + "' names no device"};
  return StreamOpener([&calls, path = name.place, wish, controls] { return openV4l2(calls, path, wish, controls); });
}

PairedOptions pairedOptions(const CameraConfig& config, CaptureLog log) {
  PairedOptions options;
  options.rig = config.rig;
  options.depth_is_registered = config.registration == "device";
  options.shrink = config.shrink;
  options.max_gap_ns = int64_t{config.pair_gap_ms} * 1'000'000;
  options.hot_C = config.hot_celsius;
  options.thermal_folder = config.thermal_folder;
  options.log = std::move(log);
  return options;
}

Result<std::unique_ptr<FrameSource>> openOpenNi2Source(const std::string& place, const CameraConfig& config,
                                                       CaptureLog log) {
  if (place.ends_with(".oni")) return openOniFile(place, config);
  auto camera = openOpenNi2(place, config);
  if (!camera) return camera.error();
  PairedOptions options = pairedOptions(config, std::move(log));
  options.rig = camera->rig;
  options.depth_is_registered = camera->depth_is_registered;
  return openPaired(std::move(camera->colour), std::move(camera->depth), std::move(options));
}

}  // namespace

bool isCameraScheme(const std::string& scheme) { return scheme == "v4l2" || scheme == "pair" || scheme == "openni2"; }

Result<std::unique_ptr<FrameSource>> openCamera(const std::string& scheme, const std::string& place,
                                                const CameraConfig& config, CaptureLog log, VideoCalls& calls) {
  if (scheme == "openni2") return openOpenNi2Source(place, config, std::move(log));
  const size_t comma = place.find(',');
  if (comma == std::string::npos || comma == 0 || (scheme == "v4l2" && comma + 1 == place.size()))
    return Error{ErrorCode::kWrongUse, scheme + ":" + place + " does not name two streams, as " + scheme +
                                           (scheme == "pair" ? ":COLOUR_URI,DEPTH_URI" : ":COLOUR,DEPTH")};
  const std::string prefix = scheme == "pair" ? std::string() : scheme + ":";
  const auto colour = parseStream(prefix + place.substr(0, comma));
  if (!colour) return colour.error();
  const auto depth = parseStream(prefix + place.substr(comma + 1));
  if (!depth) return depth.error();
  std::error_code ignored;
  const bool same = colour->place == depth->place ||
                    (colour->scheme == "v4l2" && std::filesystem::equivalent(colour->place, depth->place, ignored));
  if (colour->scheme == depth->scheme && same)
    return Error{ErrorCode::kWrongUse, scheme + ":" + place + " names one device for both colour and depth"};
  auto open_colour = openerOf(calls, *colour, PictureKind::kColour, config);
  if (!open_colour) return open_colour.error();
  auto open_depth = openerOf(calls, *depth, PictureKind::kDepth, config);
  if (!open_depth) return open_depth.error();
  return openPaired(std::move(*open_colour), std::move(*open_depth), pairedOptions(config, std::move(log)));
}

std::vector<std::string> cameraSchemes() {
  const char* const no_libcamera = hasLibcamera() ? "" : ": not in this build, libcamera-dev was missing";
  const char* const absence = hasOpenNi2() ? "" : ": not in this build, libopenni2-dev was missing";
  return {"v4l2:COLOUR,DEPTH (two device files of a camera, such as v4l2:/dev/video2,/dev/video0)",
          "pair:COLOUR_URI,DEPTH_URI (any colour stream with any depth stream, such as "
          "pair:v4l2:/dev/video4,openni2:)",
          std::string("libcamera:ID as the colour stream of a pair, such as pair:libcamera:ID,openni2: (ID may be left "
                      "out if there is one)") +
              no_libcamera,
          std::string("openni2:URI (a camera that OpenNI2 opens, any if URI is empty)") + absence,
          std::string("openni2:FILE.oni (a recording of OpenNI2)") + absence};
}

std::vector<std::string> v4l2Found(VideoCalls& calls) {
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
    lines.push_back("v4l2 " + path + ": " + offer->card + " (" + offer->bus +
                    (offer->multi_plane ? ", multi-plane)" : ")"));
    for (const VideoMode& mode : offer->modes) lines.push_back("  " + toString(mode));
    std::string others;
    for (const std::string& name : offer->other_formats) others += " " + name;
    if (!others.empty()) lines.push_back("  not understood here:" + others);
  }
  return lines;
}

std::vector<std::string> camerasFound(VideoCalls& calls) {
  std::vector<std::string> lines = v4l2Found(calls);
  for (std::string& line : libcameraFound()) lines.push_back(std::move(line));
  for (std::string& line : openNi2Found()) lines.push_back(std::move(line));
  return lines;
}

}  // namespace comap
