#include "edge_agent/capture/v4l2_controls.h"

#include <linux/videodev2.h>

#include <cerrno>
#include <cstring>
#include <optional>

namespace comap {
namespace {

constexpr int kExposureUnit_us = 100;

// Of a control that can be set.
std::optional<v4l2_queryctrl> rangeOf(VideoCalls& calls, int descriptor, uint32_t id) {
  v4l2_queryctrl range{};
  range.id = id;
  if (calls.control(descriptor, VIDIOC_QUERYCTRL, &range) != 0 || (range.flags & V4L2_CTRL_FLAG_DISABLED) != 0)
    return std::nullopt;
  return range;
}

Result<void> set(VideoCalls& calls, int descriptor, const std::string& path, uint32_t id, const std::string& name,
                 int value) {
  const auto range = rangeOf(calls, descriptor, id);
  if (!range) return Error{ErrorCode::kWrongUse, path + ": has no control for " + name};
  if (value < range->minimum || value > range->maximum)
    return Error{ErrorCode::kWrongUse, path + ": " + name + " " + std::to_string(value) + " is outside its range " +
                                           std::to_string(range->minimum) + ".." + std::to_string(range->maximum)};
  v4l2_control control{id, value};
  if (const int failed = calls.control(descriptor, VIDIOC_S_CTRL, &control); failed != 0)
    return Error{failed == -EINVAL || failed == -ERANGE ? ErrorCode::kWrongUse : ErrorCode::kUnreachable,
                 path + ": " + name + " " + std::to_string(value) + " is refused: " + std::strerror(-failed)};
  return {};
}

Result<void> setExposure(VideoCalls& calls, int descriptor, const std::string& path, int exposure_us) {
  if (exposure_us == 0) {  // most webcams know only "aperture priority" as automatic
    auto done =
        set(calls, descriptor, path, V4L2_CID_EXPOSURE_AUTO, "automatic exposure", V4L2_EXPOSURE_APERTURE_PRIORITY);
    if (done || done.error().code == ErrorCode::kUnreachable) return done;
    return set(calls, descriptor, path, V4L2_CID_EXPOSURE_AUTO, "automatic exposure", V4L2_EXPOSURE_AUTO);
  }
  if (rangeOf(calls, descriptor, V4L2_CID_EXPOSURE_AUTO))
    if (auto done = set(calls, descriptor, path, V4L2_CID_EXPOSURE_AUTO, "manual exposure", V4L2_EXPOSURE_MANUAL);
        !done)
      return done;
  return set(calls, descriptor, path, V4L2_CID_EXPOSURE_ABSOLUTE, "exposure (in units of 100 us)",
             (exposure_us + kExposureUnit_us / 2) / kExposureUnit_us);
}

}  // namespace

Result<void> setControls(VideoCalls& calls, int descriptor, const std::string& path, const VideoControls& controls) {
  if (controls.exposure_us != VideoControls::kLeave)
    if (auto done = setExposure(calls, descriptor, path, controls.exposure_us); !done) return done;
  if (controls.gain == VideoControls::kLeave) return {};
  if (rangeOf(calls, descriptor, V4L2_CID_AUTOGAIN))
    if (auto done = set(calls, descriptor, path, V4L2_CID_AUTOGAIN, "automatic gain", 0); !done) return done;
  return set(calls, descriptor, path, V4L2_CID_GAIN, "gain", controls.gain);
}

}  // namespace comap
