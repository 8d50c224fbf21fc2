// Cameras and recordings that OpenNI2 opens: Kinect-like and Orbbec sensors, .oni files.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "edge_agent/capture/camera_config.h"
#include "edge_agent/capture/frame_source.h"
#include "edge_agent/capture/picture_stream.h"

namespace comap {

/// Whether this build can. If not, every other function here refuses (kUnreachable) and says what is missing.
bool hasOpenNi2();

/// Both streams of one device that must be used together.
struct OpenNi2Camera {
  StreamOpener colour, depth;
  CameraRig rig;                     ///< the configuration's; focal lengths that it does not know are the device's
  bool depth_is_registered = false;  ///< by the device
};

/// Opens the device `uri` (empty = any) as the configuration wants it: sizes, rate, no mirroring, registration if the
/// device offers it and the configuration does not say otherwise. Depth values count as the device says, whatever
/// depth_units_per_m is. kUnreachable if it is not there; kWrongUse if it does not offer what is wanted.
Result<OpenNi2Camera> openOpenNi2(const std::string& uri, const CameraConfig& config);

/// One stream alone of the device, for a pair with another camera's.
Result<StreamOpener> openOpenNi2Stream(const std::string& uri, PictureKind kind, const CameraConfig& config);

/// A recording: pairs of pictures at most camera.pair_gap_ms apart, in order of time, every one of them. Stamps count
/// from its first picture. kUnreachable if the file cannot be opened, kBadData if it lacks a stream.
Result<std::unique_ptr<FrameSource>> openOniFile(const std::string& path, const CameraConfig& config);

/// One line a device found, and what it offers indented below.
std::vector<std::string> openNi2Found();

}  // namespace comap
