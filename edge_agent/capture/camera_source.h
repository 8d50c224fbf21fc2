// Live cameras by name.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "edge_agent/capture/camera_config.h"
#include "edge_agent/capture/capture_log.h"
#include "edge_agent/capture/frame_source.h"
#include "edge_agent/capture/video_calls.h"

namespace comap {

/// Whether openCamera takes it. True also where this build lacks the library: openCamera then says what is missing.
bool isCameraScheme(const std::string& scheme);

/// Opens `scheme:place`: `v4l2:COLOUR,DEPTH` (device files), `openni2:URI`, `openni2:FILE.oni` (a recording) or
/// `pair:URI,URI` (colour, depth; each v4l2:DEVICE or openni2:URI, colour also libcamera:ID). Errors of openPaired and
/// of the devices, which name the device.
Result<std::unique_ptr<FrameSource>> openCamera(const std::string& scheme, const std::string& place,
                                                const CameraConfig& config, CaptureLog log,
                                                VideoCalls& calls = systemVideoCalls());

/// One line a scheme: how to write it and what it is. Those that this build cannot open are listed too, and say so.
std::vector<std::string> cameraSchemes();

/// What is plugged in: a line a device, and indented below what it offers, or why it cannot be used.
std::vector<std::string> camerasFound(VideoCalls& calls = systemVideoCalls());

/// The same for devices of the kernel alone.
std::vector<std::string> v4l2Found(VideoCalls& calls);

}  // namespace comap
