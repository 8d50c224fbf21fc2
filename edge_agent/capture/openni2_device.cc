#include "edge_agent/capture/openni2_device.h"

#include <spdlog/fmt/fmt.h>

#include <cmath>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

namespace comap::openni2_detail {
namespace {

struct Known {
  openni::PixelFormat theirs;
  PixelFormat format;
  PictureKind kind;
  double units_per_m;
};
constexpr Known kKnown[] = {
    {openni::PIXEL_FORMAT_RGB888, PixelFormat::kRgb3, PictureKind::kColour, 0},
    {openni::PIXEL_FORMAT_YUYV, PixelFormat::kYuyv, PictureKind::kColour, 0},
    {openni::PIXEL_FORMAT_DEPTH_1_MM, PixelFormat::kZ16, PictureKind::kDepth, 1000},
    {openni::PIXEL_FORMAT_DEPTH_100_UM, PixelFormat::kZ16, PictureKind::kDepth, 10000},
};

const Known* known(openni::PixelFormat format) {
  for (const Known& one : kKnown)
    if (one.theirs == format) return &one;
  return nullptr;
}

bool fits(const openni::VideoMode& mode, const VideoWish& wish) {
  const Known* format = known(mode.getPixelFormat());
  return format != nullptr && format->kind == wish.kind &&
         (wish.format == "auto" || wish.format == toString(format->format)) &&
         (wish.width == 0 || wish.width == mode.getResolutionX()) &&
         (wish.height == 0 || wish.height == mode.getResolutionY());
}

std::string describe(const openni::VideoMode& mode) {
  const Known* format = known(mode.getPixelFormat());
  return fmt::format("{} {}x{} {} fps", format != nullptr ? toString(format->format) : std::string("?"),
                     mode.getResolutionX(), mode.getResolutionY(), mode.getFps());
}

// Tasks of all threads, one after the other.
class LibraryThread {
 public:
  LibraryThread() : thread_([this] { work(); }) { thread_.detach(); }

  void run(const std::function<void()>& task) {
    if (std::this_thread::get_id() == id_) return task();
    std::unique_lock lock(mutex_);
    free_.wait(lock, [this] { return task_ == nullptr; });
    task_ = &task;
    wake_.notify_one();
    done_.wait(lock, [&] { return finished_; });
    finished_ = false;
    task_ = nullptr;
    free_.notify_one();
  }

 private:
  void work() {
    std::unique_lock lock(mutex_);
    id_ = std::this_thread::get_id();
    while (true) {
      wake_.wait(lock, [this] { return task_ != nullptr && !finished_; });
      const auto& task = *task_;
      lock.unlock();
      task();
      lock.lock();
      finished_ = true;
      done_.notify_one();
    }
  }

  std::mutex mutex_;
  std::condition_variable free_, wake_, done_;
  const std::function<void()>* task_ = nullptr;
  bool finished_ = false;
  std::atomic<std::thread::id> id_;
  std::thread thread_;
};

}  // namespace

void onLibraryThread(const std::function<void()>& task) {
  static LibraryThread& thread = *new LibraryThread;  // never ended
  thread.run(task);
}

Error problem(ErrorCode code, const std::string& doing) {
  std::string why = openni::OpenNI::getExtendedError();
  for (char& c : why)
    if (std::isspace(static_cast<unsigned char>(c)) != 0) c = ' ';
  while (why.ends_with(' ')) why.pop_back();
  why.erase(0, why.find_first_not_of(' '));
  return {code, doing + (why.empty() ? std::string() : ": " + why)};
}

Result<void> startLibrary() {
  static const openni::Status started = openni::OpenNI::initialize();
  if (started != openni::STATUS_OK) return problem(ErrorCode::kUnreachable, "OpenNI2 does not start");
  return {};
}

Result<std::shared_ptr<Device>> Device::open(const std::string& uri) {
  if (auto started = startLibrary(); !started) return started.error();
  std::shared_ptr<Device> made(new Device);
  const std::string name = uri.empty() ? std::string("any OpenNI2 device") : "OpenNI2 device '" + uri + "'";
  if (made->device_.open(uri.empty() ? openni::ANY_DEVICE : uri.c_str()) != openni::STATUS_OK)
    return problem(ErrorCode::kUnreachable, name + " cannot be opened");
  made->uri_ = made->device_.getDeviceInfo().getUri();
  openni::OpenNI::addDeviceDisconnectedListener(made.get());
  return made;
}

Device::~Device() {
  onLibraryThread([this] {
    openni::OpenNI::removeDeviceDisconnectedListener(this);
    device_.close();
  });
}

void Device::onDeviceDisconnected(const openni::DeviceInfo* info) {
  if (uri_ == info->getUri()) gone_ = true;
}

Result<ReadyStream> prepare(Device& device, const VideoWish& wish) {
  const bool colour = wish.kind == PictureKind::kColour;
  const auto sensor = colour ? openni::SENSOR_COLOR : openni::SENSOR_DEPTH;
  const std::string name = device.uri() + (colour ? ": colour" : ": depth");
  if (!device.device().hasSensor(sensor)) return Error{ErrorCode::kWrongUse, name + ": the device has none"};
  ReadyStream made{std::make_unique<openni::VideoStream>()};
  if (made.stream->create(device.device(), sensor) != openni::STATUS_OK)
    return problem(ErrorCode::kUnreachable, name + " cannot be opened");
  if (!device.device().isFile()) {
    const auto& modes = made.stream->getSensorInfo().getSupportedVideoModes();
    const openni::VideoMode* best = nullptr;
    std::string offered;
    for (int i = 0; i < modes.getSize(); ++i) {
      offered += (offered.empty() ? "" : ", ") + describe(modes[i]);
      if (!fits(modes[i], wish)) continue;
      const auto away = [&](const openni::VideoMode& mode) { return std::abs(mode.getFps() - wish.fps); };
      if (best == nullptr || away(modes[i]) < away(*best)) best = &modes[i];
    }
    if (best == nullptr)
      return Error{ErrorCode::kWrongUse,
                   fmt::format("{}{}{} is not offered (camera.{}); it offers: {}", name,
                               wish.format == "auto" ? std::string() : " as " + wish.format,
                               wish.width == 0 ? std::string() : fmt::format(" of {}x{}", wish.width, wish.height),
                               colour ? "colour" : "depth", offered)};
    if (made.stream->setVideoMode(*best) != openni::STATUS_OK)
      return problem(ErrorCode::kUnreachable, name + ": " + describe(*best) + " is refused");
    // Mirrored pictures are the default of some drivers, and no camera at all to whoever tracks.
    if (made.stream->isPropertySupported(openni::STREAM_PROPERTY_MIRRORING)) made.stream->setMirroringEnabled(false);
  }
  made.mode = made.stream->getVideoMode();
  const Known* format = known(made.mode.getPixelFormat());
  if (format == nullptr || format->kind != wish.kind)
    return Error{ErrorCode::kBadData, fmt::format("{} has pixels of format {}, which is not understood here", name,
                                                  static_cast<int>(made.mode.getPixelFormat()))};
  made.format = format->format;
  made.units_per_m = format->units_per_m;
  return made;
}

Lens lensOf(const openni::VideoStream& stream) {
  const openni::VideoMode mode = stream.getVideoMode();
  Lens lens;
  CameraModel& p = lens.pinhole;
  p.width = mode.getResolutionX();
  p.height = mode.getResolutionY();
  p.cx = (p.width - 1) / 2.0;
  p.cy = (p.height - 1) / 2.0;
  const double across = stream.getHorizontalFieldOfView(), down = stream.getVerticalFieldOfView();
  if (across > 0 && across < M_PI) p.fx = p.width / 2.0 / std::tan(across / 2);
  p.fy = down > 0 && down < M_PI ? p.height / 2.0 / std::tan(down / 2) : p.fx;
  return lens;
}

Picture pictureOf(const openni::VideoFrameRef& frame, PixelFormat format) {
  Picture picture;
  picture.format = format;
  picture.width = frame.getWidth();
  picture.height = frame.getHeight();
  picture.stride_bytes = frame.getStrideInBytes();
  picture.full_range = true;
  picture.sequence = static_cast<uint64_t>(std::max(frame.getFrameIndex(), 0));
  picture.stamp_ns = static_cast<int64_t>(frame.getTimestamp()) * 1000;
  const auto* bytes = static_cast<const uint8_t*>(frame.getData());
  if (bytes != nullptr && frame.getDataSize() > 0) picture.bytes.assign(bytes, bytes + frame.getDataSize());
  return picture;
}

}  // namespace comap::openni2_detail
