// A plug-in for OpenNI2 with one device: it shows the TUM-format folder that COMAP_TEST_SCENE names, one pair each
// COMAP_TEST_PERIOD_MS, over and over if COMAP_TEST_REPEAT is set. While the folder holds a file "unplugged" the device
// is not there. If COMAP_TEST_REGISTERS is set, it offers to register depth into colour.
#include <cstdlib>

#define XN_NEW(type, ...) (new type(__VA_ARGS__))
#define XN_DELETE(pointer) (delete (pointer))
#include <Driver/OniDriverAPI.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "edge_agent/capture/tum_source.h"

namespace {

using namespace oni::driver;

const char* setting(const char* name) { return std::getenv(name); }

std::vector<comap::Frame> readScene() {
  std::vector<comap::Frame> frames;
  const char* folder = setting("COMAP_TEST_SCENE");
  auto source = comap::openTum(folder == nullptr ? "" : folder);
  if (!source) return frames;
  while (true) {
    auto next = (*source)->next();
    if (!next || !*next) return frames;
    frames.push_back(std::move(**next));
  }
}

OniVideoMode modeOf(OniSensorType sensor, const comap::CameraModel& camera) {
  OniVideoMode mode{};
  mode.pixelFormat = sensor == ONI_SENSOR_COLOR ? ONI_PIXEL_FORMAT_RGB888 : ONI_PIXEL_FORMAT_DEPTH_1_MM;
  mode.resolutionX = camera.width;
  mode.resolutionY = camera.height;
  mode.fps = 30;
  return mode;
}

class SceneStream final : public StreamBase {
 public:
  SceneStream(OniSensorType sensor, const std::vector<comap::Frame>& frames)
      : sensor_(sensor), frames_(frames), mode_(modeOf(sensor, frames.front().camera)) {}

  OniStatus start() override {
    running_ = true;
    return ONI_STATUS_OK;
  }
  void stop() override { running_ = false; }
  bool running() const { return running_; }

  OniStatus getProperty(int id, void* data, int* size) override {
    const auto give = [&](const auto& value) {
      std::memcpy(data, &value, sizeof value);
      *size = sizeof value;
      return ONI_STATUS_OK;
    };
    switch (id) {
      case ONI_STREAM_PROPERTY_VIDEO_MODE:
        return give(mode_);
      case ONI_STREAM_PROPERTY_HORIZONTAL_FOV:
        return give(across());
      case ONI_STREAM_PROPERTY_VERTICAL_FOV:
        return give(down());
      case ONI_STREAM_PROPERTY_CROPPING:
        return give(cropping_);
      case ONI_STREAM_PROPERTY_MIRRORING:
        return give(mirrored_);
      default:
        return ONI_STATUS_NOT_SUPPORTED;
    }
  }
  OniStatus setProperty(int id, const void* data, int size) override {
    if (id == ONI_STREAM_PROPERTY_VIDEO_MODE && size == sizeof mode_) {
      std::memcpy(&mode_, data, sizeof mode_);
      return ONI_STATUS_OK;
    }
    if (id == ONI_STREAM_PROPERTY_MIRRORING && size == sizeof mirrored_) {
      std::memcpy(&mirrored_, data, sizeof mirrored_);
      return ONI_STATUS_OK;
    }
    return ONI_STATUS_NOT_SUPPORTED;
  }
  OniBool isPropertySupported(int id) override {
    return id == ONI_STREAM_PROPERTY_VIDEO_MODE || id == ONI_STREAM_PROPERTY_HORIZONTAL_FOV ||
           id == ONI_STREAM_PROPERTY_VERTICAL_FOV || id == ONI_STREAM_PROPERTY_CROPPING ||
           id == ONI_STREAM_PROPERTY_MIRRORING;
  }
  void notifyAllProperties() override {  // a recorder takes none of the pictures unless it hears of these
    raisePropertyChanged(ONI_STREAM_PROPERTY_VIDEO_MODE, &mode_, sizeof mode_);
    raisePropertyChanged(ONI_STREAM_PROPERTY_CROPPING, &cropping_, sizeof cropping_);
    const float fields[] = {across(), down()};
    raisePropertyChanged(ONI_STREAM_PROPERTY_HORIZONTAL_FOV, &fields[0], sizeof fields[0]);
    raisePropertyChanged(ONI_STREAM_PROPERTY_VERTICAL_FOV, &fields[1], sizeof fields[1]);
  }

  void show(const comap::Frame& frame, int index) {
    if (!running_) return;
    OniFrame* out = getServices().acquireFrame();
    if (out == nullptr) return;
    const bool colour = sensor_ == ONI_SENSOR_COLOR;
    const int width = frame.camera.width, height = frame.camera.height, bytes = colour ? 3 : 2;
    out->sensorType = sensor_;
    out->videoMode = mode_;
    out->width = width;
    out->height = height;
    out->stride = width * bytes;
    out->dataSize = width * height * bytes;
    out->croppingEnabled = FALSE;
    out->cropOriginX = out->cropOriginY = 0;
    out->frameIndex = index;
    out->timestamp = static_cast<uint64_t>(frame.stamp_ns / 1000);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        const int from = mirrored_ != 0 ? width - 1 - x : x;
        uint8_t* pixel = static_cast<uint8_t*>(out->data) + (y * width + x) * bytes;
        if (colour) {
          const comap::Rgb rgb = frame.colour.at(from, y);
          pixel[0] = rgb.r;
          pixel[1] = rgb.g;
          pixel[2] = rgb.b;
        } else {
          const auto mm = static_cast<uint16_t>(frame.depth.at(from, y) / 5);
          std::memcpy(pixel, &mm, sizeof mm);
        }
      }
    }
    raiseNewFrame(out);
    getServices().releaseFrame(out);
  }

 private:
  const comap::CameraModel& camera() const { return frames_.front().camera; }
  float across() const { return static_cast<float>(2 * std::atan(camera().width / 2.0 / camera().fx)); }
  float down() const { return static_cast<float>(2 * std::atan(camera().height / 2.0 / camera().fy)); }

  OniSensorType sensor_;
  const std::vector<comap::Frame>& frames_;
  OniVideoMode mode_;
  OniCropping cropping_{};
  OniBool mirrored_ = TRUE;  // as some real drivers begin
  std::atomic<bool> running_ = false;
};

class SceneDevice final : public DeviceBase {
 public:
  explicit SceneDevice(const std::vector<comap::Frame>& frames) : frames_(frames), thread_([this] { play(); }) {}
  ~SceneDevice() override {
    stop_ = true;
    thread_.join();
  }

  OniStatus getSensorInfoList(OniSensorInfo** infos, int* count) override {
    const comap::CameraModel& camera = frames_.front().camera;
    const OniSensorType sensors[] = {ONI_SENSOR_COLOR, ONI_SENSOR_DEPTH};
    for (int i = 0; i < 2; ++i) {
      modes_[i] = modeOf(sensors[i], camera);
      infos_[i] = {sensors[i], 1, &modes_[i]};
    }
    *infos = infos_;
    *count = 2;
    return ONI_STATUS_OK;
  }
  StreamBase* createStream(OniSensorType sensor) override {
    const std::lock_guard lock(mutex_);
    auto* stream = new SceneStream(sensor, frames_);
    streams_.push_back(stream);
    return stream;
  }
  void destroyStream(StreamBase* stream) override {
    const std::lock_guard lock(mutex_);
    std::erase(streams_, stream);
    delete stream;
  }
  OniBool isImageRegistrationModeSupported(OniImageRegistrationMode mode) override {
    return mode == ONI_IMAGE_REGISTRATION_OFF || setting("COMAP_TEST_REGISTERS") != nullptr;
  }
  OniBool isPropertySupported(int id) override { return id == ONI_DEVICE_PROPERTY_IMAGE_REGISTRATION; }
  OniStatus setProperty(int id, const void* data, int size) override {
    if (id != ONI_DEVICE_PROPERTY_IMAGE_REGISTRATION || size != sizeof registration_) return ONI_STATUS_NOT_SUPPORTED;
    std::memcpy(&registration_, data, sizeof registration_);
    return ONI_STATUS_OK;
  }
  OniStatus getProperty(int id, void* data, int* size) override {
    if (id != ONI_DEVICE_PROPERTY_IMAGE_REGISTRATION) return ONI_STATUS_NOT_SUPPORTED;
    std::memcpy(data, &registration_, sizeof registration_);
    *size = sizeof registration_;
    return ONI_STATUS_OK;
  }
  void pause(bool paused) { paused_ = paused; }

 private:
  // Each pair once both eyes look.
  void play() {
    const char* period = setting("COMAP_TEST_PERIOD_MS");
    const std::chrono::milliseconds turn(period == nullptr ? 33 : std::atoi(period));
    size_t shown = 0;
    int64_t later_ns = 0;
    while (!stop_) {
      std::this_thread::sleep_for(turn);
      const std::lock_guard lock(mutex_);
      const bool both = streams_.size() == 2 && std::all_of(streams_.begin(), streams_.end(), [](StreamBase* stream) {
                          return static_cast<SceneStream*>(stream)->running();
                        });
      if (!both || paused_ || (shown >= frames_.size() && setting("COMAP_TEST_REPEAT") == nullptr)) continue;
      comap::Frame frame = frames_[shown % frames_.size()];
      frame.stamp_ns += later_ns;
      ++shown;
      if (shown % frames_.size() == 0) later_ns = frame.stamp_ns;
      for (StreamBase* stream : streams_) static_cast<SceneStream*>(stream)->show(frame, static_cast<int>(shown));
    }
  }

  const std::vector<comap::Frame>& frames_;
  std::mutex mutex_;
  std::vector<StreamBase*> streams_;
  OniVideoMode modes_[2]{};
  OniSensorInfo infos_[2]{};
  OniImageRegistrationMode registration_ = ONI_IMAGE_REGISTRATION_OFF;
  std::atomic<bool> stop_ = false, paused_ = false;
  std::thread thread_;
};

class SceneDriver final : public DriverBase {
 public:
  explicit SceneDriver(OniDriverServices* services) : DriverBase(services) {
    std::strcpy(info_.uri, "comap-test/1");
    std::strcpy(info_.vendor, "CoMap");
    std::strcpy(info_.name, "Scene");
  }

  OniStatus initialize(DeviceConnectedCallback connected, DeviceDisconnectedCallback disconnected,
                       DeviceStateChangedCallback changed, void* cookie) override {
    DriverBase::initialize(connected, disconnected, changed, cookie);
    frames_ = readScene();
    if (frames_.empty()) return ONI_STATUS_OK;
    deviceConnected(&info_);
    plugged_ = true;
    watch_ = std::thread([this] { watch(); });
    return ONI_STATUS_OK;
  }
  DeviceBase* deviceOpen(const char* /*uri*/, const char* /*mode*/) override {
    if (!plugged_) return nullptr;
    auto* device = new SceneDevice(frames_);
    const std::lock_guard lock(mutex_);
    open_.push_back(device);
    return device;
  }
  void deviceClose(DeviceBase* device) override {
    {
      const std::lock_guard lock(mutex_);
      std::erase(open_, device);
    }
    delete device;
  }
  void shutdown() override {
    stop_ = true;
    if (watch_.joinable()) watch_.join();
  }

 private:
  void watch() {
    const std::filesystem::path sign = std::filesystem::path(setting("COMAP_TEST_SCENE")) / "unplugged";
    while (!stop_) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
      std::error_code ignored;
      const bool there = !std::filesystem::exists(sign, ignored);
      if (there == plugged_) continue;
      plugged_ = there;
      {
        const std::lock_guard lock(mutex_);
        for (SceneDevice* device : open_) device->pause(!there);
      }
      if (there) {
        deviceConnected(&info_);
      } else {
        deviceDisconnected(&info_);
      }
    }
  }

  OniDeviceInfo info_{};
  std::vector<comap::Frame> frames_;
  std::mutex mutex_;
  std::vector<SceneDevice*> open_;
  std::atomic<bool> plugged_ = false, stop_ = false;
  std::thread watch_;
};

}  // namespace

ONI_EXPORT_DRIVER(SceneDriver)
