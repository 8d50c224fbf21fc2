// Live devices of OpenNI2.
#include <spdlog/fmt/fmt.h>

#include <condition_variable>
#include <mutex>

#include "edge_agent/capture/live_stream.h"
#include "edge_agent/capture/openni2.h"
#include "edge_agent/capture/openni2_device.h"

namespace comap {
namespace {

using namespace openni2_detail;

class OpenNi2Stream final : public PictureStream, private openni::VideoStream::NewFrameListener {
 public:
  OpenNi2Stream(std::shared_ptr<Device> device, ReadyStream ready)
      : device_(std::move(device)), ready_(std::move(ready)) {}
  ~OpenNi2Stream() override {
    onLibraryThread([this] {
      ready_.stream->removeNewFrameListener(this);
      ready_.stream->stop();
      ready_.stream->destroy();
    });
  }

  Result<void> start() {
    ready_.stream->addNewFrameListener(this);
    if (ready_.stream->start() != openni::STATUS_OK)
      return problem(ErrorCode::kUnreachable, device_->uri() + ": the stream does not start");
    return {};
  }

  Result<std::optional<Picture>> take(std::chrono::milliseconds timeout) override {
    if (device_->gone()) return Error{ErrorCode::kUnreachable, device_->uri() + ": was unplugged"};
    {
      std::unique_lock lock(mutex_);
      if (!bell_.wait_for(lock, timeout, [this] { return came_; })) return std::optional<Picture>();
      came_ = false;
    }
    Result<std::optional<Picture>> taken = std::optional<Picture>();
    onLibraryThread([&] { taken = read(); });
    if (taken && *taken) (*taken)->stamp_ns = device_->clock().toHost((*taken)->stamp_ns, monotonicNow_ns());
    return taken;
  }

  std::string description() const override {
    return fmt::format("OpenNI2 {}, {} {}x{}, {} fps", device_->uri(), toString(ready_.format),
                       ready_.mode.getResolutionX(), ready_.mode.getResolutionY(), ready_.mode.getFps());
  }

 private:
  Result<std::optional<Picture>> read() {
    openni::VideoStream* stream = ready_.stream.get();
    int which = 0;
    const openni::Status waited = openni::OpenNI::waitForAnyStream(&stream, 1, &which, openni::TIMEOUT_NONE);
    if (waited == openni::STATUS_TIME_OUT) return std::optional<Picture>();  // it was read with the one before
    openni::VideoFrameRef frame;
    if (waited != openni::STATUS_OK || stream->readFrame(&frame) != openni::STATUS_OK)
      return problem(ErrorCode::kUnreachable, device_->uri() + ": gives no pictures");
    return std::optional<Picture>(pictureOf(frame, ready_.format));
  }

  // On a thread of the driver.
  void onNewFrame(openni::VideoStream& /*stream*/) override {
    const std::lock_guard lock(mutex_);
    came_ = true;
    bell_.notify_one();
  }

  std::shared_ptr<Device> device_;
  ReadyStream ready_;
  std::mutex mutex_;
  std::condition_variable bell_;
  bool came_ = false;
};

VideoWish wishOf(PictureKind kind, const CameraConfig& config, bool registered) {
  const bool colour = kind == PictureKind::kColour;
  const Lens& lens = colour || registered ? config.rig.colour : config.rig.depth;
  return {kind, colour ? config.colour_format : config.depth_format, lens.pinhole.width, lens.pinhole.height,
          config.fps};
}

Result<void> setControls(openni::VideoStream& stream, const std::string& uri, PictureKind kind,
                         const VideoControls& controls) {
  if (controls.exposure_us == VideoControls::kLeave && controls.gain == VideoControls::kLeave) return {};
  openni::CameraSettings* settings = stream.getCameraSettings();
  const std::string section = kind == PictureKind::kColour ? "camera.colour." : "camera.depth.";
  const auto refused = [&](const std::string& key, int value) {
    return problem(ErrorCode::kWrongUse, fmt::format("{}: {}{} of {} is refused", uri, section, key, value));
  };
  if (settings == nullptr)
    return Error{ErrorCode::kWrongUse, uri + ": has no control for " + section +
                                           (controls.exposure_us != VideoControls::kLeave ? "exposure_us" : "gain")};
  if (controls.exposure_us != VideoControls::kLeave &&
      settings->setAutoExposureEnabled(controls.exposure_us == 0) != openni::STATUS_OK)
    return refused("exposure_us", controls.exposure_us);
  if (controls.exposure_us > 0 && settings->setExposure(controls.exposure_us) != openni::STATUS_OK)
    return refused("exposure_us", controls.exposure_us);
  if (controls.gain != VideoControls::kLeave && settings->setGain(controls.gain) != openni::STATUS_OK)
    return refused("gain", controls.gain);
  return {};
}

// The device as both streams share it. When it was gone, the first stream that opens it again opens it for both.
class SharedDevice {
 public:
  SharedDevice(std::string uri, CameraConfig config) : uri_(std::move(uri)), config_(std::move(config)) {}

  Result<std::shared_ptr<Device>> get() {
    const std::lock_guard lock(mutex_);
    if (auto held = device_.lock()) {
      if (!held->gone()) return held;
      return Error{ErrorCode::kUnreachable, held->uri() + ": was unplugged"};  // the other stream lets go of it soon
    }
    auto opened = Device::open(uri_);
    if (!opened) return opened.error();
    if (auto set = registerDepth(**opened); !set) return set.error();
    (*opened)->device().setDepthColorSyncEnabled(true);  // devices without it pair as well as they can
    device_ = *opened;
    return *opened;
  }

  bool registered() const { return registered_.value_or(false); }
  const CameraConfig& config() const { return config_; }

  Result<std::unique_ptr<PictureStream>> open(PictureKind kind) {
    Result<std::unique_ptr<PictureStream>> opened = std::unique_ptr<PictureStream>();
    onLibraryThread([&] { opened = openHere(kind); });
    return opened;
  }

 private:
  Result<std::unique_ptr<PictureStream>> openHere(PictureKind kind) {
    auto device = get();
    if (!device) return device.error();
    auto ready = prepare(**device, wishOf(kind, config_, registered()));
    if (!ready) return ready.error();
    const bool colour = kind == PictureKind::kColour;
    if (auto set = setControls(*ready->stream, (*device)->uri(), kind,
                               colour ? config_.colour_controls : config_.depth_controls);
        !set)
      return set.error();
    auto stream = std::make_unique<OpenNi2Stream>(std::move(*device), std::move(*ready));
    if (auto started = stream->start(); !started) return started.error();
    return std::unique_ptr<PictureStream>(std::move(stream));
  }

  Result<void> registerDepth(Device& device) {
    const bool offered = device.device().isImageRegistrationModeSupported(openni::IMAGE_REGISTRATION_DEPTH_TO_COLOR);
    const bool wanted = config_.registration == "device" || (config_.registration == "auto" && offered);
    if ((config_.registration == "device" || registered_.value_or(false)) && !offered)
      return Error{ErrorCode::kWrongUse, device.uri() + ": does not register depth into colour"};
    if (wanted &&
        device.device().setImageRegistrationMode(openni::IMAGE_REGISTRATION_DEPTH_TO_COLOR) != openni::STATUS_OK)
      return problem(ErrorCode::kUnreachable, device.uri() + ": depth cannot be registered");
    if (!wanted && offered) device.device().setImageRegistrationMode(openni::IMAGE_REGISTRATION_OFF);
    registered_ = wanted;
    return {};
  }

  std::string uri_;
  CameraConfig config_;
  std::mutex mutex_;
  std::weak_ptr<Device> device_;
  std::optional<bool> registered_;
};

// What the configuration does not know of the lenses, the device tells.
Result<CameraRig> complete(Device& device, const CameraConfig& config, bool registered) {
  CameraRig rig = config.rig;
  for (const PictureKind kind : {PictureKind::kColour, PictureKind::kDepth}) {
    auto ready = prepare(device, wishOf(kind, config, registered));
    if (!ready) return ready.error();
    if (kind == PictureKind::kDepth) rig.depth_units_per_m = ready->units_per_m;
    Lens& lens = kind == PictureKind::kColour ? rig.colour : rig.depth;
    if (lens.pinhole.fx <= 0) lens = lensOf(*ready->stream);
    ready->stream->destroy();
  }
  return rig;
}

}  // namespace

bool hasOpenNi2() { return true; }

Result<OpenNi2Camera> openOpenNi2(const std::string& uri, const CameraConfig& config) {
  auto shared = std::make_shared<SharedDevice>(uri, config);
  auto device = shared->get();
  if (!device) return device.error();
  OpenNi2Camera camera;
  camera.depth_is_registered = shared->registered();
  auto rig = complete(**device, config, camera.depth_is_registered);
  if (!rig) return rig.error();
  camera.rig = *rig;
  // The device stays open until the streams hold it themselves: it is opened once.
  auto until_started = std::make_shared<std::shared_ptr<Device>>(std::move(*device));
  camera.colour = [shared, until_started] { return shared->open(PictureKind::kColour); };
  camera.depth = [shared, until_started] {
    auto opened = shared->open(PictureKind::kDepth);
    until_started->reset();
    return opened;
  };
  return camera;
}

Result<StreamOpener> openOpenNi2Stream(const std::string& uri, PictureKind kind, const CameraConfig& config) {
  if (auto started = startLibrary(); !started) return started.error();
  CameraConfig alone = config;
  if (alone.registration == "auto") alone.registration = "software";  // its own colour camera is not the pair's
  auto shared = std::make_shared<SharedDevice>(uri, alone);
  return StreamOpener([shared, kind] { return shared->open(kind); });
}

std::vector<std::string> openNi2Found() {
  if (auto started = startLibrary(); !started) return {started.error().text};
  openni::Array<openni::DeviceInfo> devices;
  openni::OpenNI::enumerateDevices(&devices);
  std::vector<std::string> lines;
  for (int i = 0; i < devices.getSize(); ++i) {
    lines.push_back(
        fmt::format("openni2 {}: {} {}", devices[i].getUri(), devices[i].getVendor(), devices[i].getName()));
    openni::Device device;
    if (device.open(devices[i].getUri()) != openni::STATUS_OK) {
      lines.push_back("  " + problem(ErrorCode::kUnreachable, "cannot be opened").text);
      continue;
    }
    for (const auto sensor : {openni::SENSOR_COLOR, openni::SENSOR_DEPTH}) {
      const openni::SensorInfo* info = device.getSensorInfo(sensor);
      if (info == nullptr) continue;
      const auto& modes = info->getSupportedVideoModes();
      for (int m = 0; m < modes.getSize(); ++m)
        lines.push_back(fmt::format("  {} {}x{} {} fps", sensor == openni::SENSOR_COLOR ? "colour" : "depth",
                                    modes[m].getResolutionX(), modes[m].getResolutionY(), modes[m].getFps()));
    }
    const bool registers = device.isImageRegistrationModeSupported(openni::IMAGE_REGISTRATION_DEPTH_TO_COLOR);
    lines.push_back(registers ? "  registers depth into colour" : "  does not register depth into colour");
  }
  return lines;
}

}  // namespace comap
