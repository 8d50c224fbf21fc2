#include <libcamera/libcamera.h>
#include <spdlog/fmt/fmt.h>
#include <sys/mman.h>

#include <array>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <map>
#include <mutex>

#include "edge_agent/capture/libcamera.h"

namespace comap {
namespace {

namespace lc = libcamera;

constexpr size_t kMostBufferBytes = size_t{256} << 20;

struct Known {
  lc::PixelFormat theirs;
  PixelFormat format;
};
// What costs nothing to decode first. Their names tell the order in a word, the lowest byte last.
const std::array kKnown{Known{lc::formats::YUYV, PixelFormat::kYuyv}, Known{lc::formats::NV12, PixelFormat::kNv12},
                        Known{lc::formats::BGR888, PixelFormat::kRgb3}, Known{lc::formats::RGB888, PixelFormat::kBgr3},
                        Known{lc::formats::MJPEG, PixelFormat::kMjpeg}};

// One for the process, as libcamera wants it; it stays until the process ends.
Result<lc::CameraManager*> manager() {
  static lc::CameraManager* const made = [] {
    lc::logSetTarget(lc::LoggingTargetNone);  // what fails is told in our own words
    return new lc::CameraManager;
  }();
  static const int started = made->start();
  if (started < 0)
    return Error{ErrorCode::kUnreachable, std::string("libcamera does not start: ") + std::strerror(-started)};
  return made;
}

Result<std::shared_ptr<lc::Camera>> find(const std::string& id) {
  auto all = manager();
  if (!all) return all.error();
  std::string names;
  const auto cameras = (*all)->cameras();
  for (const auto& camera : cameras) {
    if (camera->id() == id || (id.empty() && cameras.size() == 1)) return camera;
    names += (names.empty() ? "" : ", ") + camera->id();
  }
  const std::string wanted =
      id.empty() ? std::string("no camera is named, and there is not just one") : "camera '" + id + "' is not there";
  return Error{id.empty() && !cameras.empty() ? ErrorCode::kWrongUse : ErrorCode::kUnreachable,
               "libcamera: " + wanted + "; there are: " + (names.empty() ? std::string("none") : names)};
}

std::string offeredBy(const lc::StreamConfiguration& stream) {
  std::string text;
  for (const lc::PixelFormat& format : stream.formats().pixelformats())
    text += (text.empty() ? "" : ", ") + format.toString() + " " + stream.formats().range(format).toString();
  return text.empty() ? std::string("nothing") : text;
}

class LibcameraStream final : public PictureStream {
 public:
  explicit LibcameraStream(std::shared_ptr<lc::Camera> camera) : camera_(std::move(camera)) {}

  ~LibcameraStream() override {
    if (started_) camera_->stop();
    camera_->requestCompleted.disconnect(this);
    camera_->disconnected.disconnect(this);
    requests_.clear();
    for (const auto& [buffer, planes] : mapped_)
      for (const auto& plane : planes) munmap(plane.memory, plane.length);
    allocator_.reset();
    if (acquired_) camera_->release();
  }

  Result<void> start(const VideoWish& wish, const VideoControls& controls) {
    if (const int failed = camera_->acquire(); failed < 0)
      return problem(failed == -EBUSY ? "another program has it" : "cannot be had", failed);
    acquired_ = true;
    if (auto set = setMode(wish); !set) return set;
    lc::ControlList list(camera_->controls());
    if (auto set = setControls(wish.fps, controls, list); !set) return set;
    if (auto made = makeRequests(); !made) return made;
    camera_->requestCompleted.connect(this, &LibcameraStream::completed);
    camera_->disconnected.connect(this, &LibcameraStream::disconnected);
    if (const int failed = camera_->start(&list); failed < 0) return problem("does not start", failed);
    started_ = true;
    for (const auto& request : requests_)
      if (const int failed = camera_->queueRequest(request.get()); failed < 0)
        return problem("takes no request", failed);
    return {};
  }

  Result<std::optional<Picture>> take(std::chrono::milliseconds timeout) override {
    lc::Request* request = nullptr;
    {
      std::unique_lock lock(mutex_);
      bell_.wait_for(lock, timeout, [this] { return gone_ || !done_.empty(); });
      if (gone_) return Error{ErrorCode::kUnreachable, camera_->id() + ": was unplugged"};
      if (done_.empty()) return std::optional<Picture>();
      request = done_.front();
      done_.pop_front();
    }
    auto picture = pictureOf(*request);
    request->reuse(lc::Request::ReuseBuffers);
    if (const int failed = camera_->queueRequest(request); failed < 0)
      return problem("takes no request back", failed).error();
    return picture;
  }

  std::string description() const override {
    return fmt::format("libcamera {}, {} {}x{}", camera_->id(), toString(format_), width_, height_);
  }

 private:
  struct Plane {
    uint8_t* memory;
    size_t length, offset;
  };

  Result<void> problem(const std::string& what, int failed) const {
    return Error{ErrorCode::kUnreachable, camera_->id() + ": " + what + ": " + std::strerror(-failed)};
  }

  Result<void> setMode(const VideoWish& wish) {
    configuration_ = camera_->generateConfiguration({lc::StreamRole::Viewfinder});
    if (!configuration_ || configuration_->empty())
      return Error{ErrorCode::kUnreachable, camera_->id() + ": tells no configuration"};
    lc::StreamConfiguration& stream = configuration_->at(0);
    std::string offered = offeredBy(stream);
    for (const Known& known : kKnown) {
      if (wish.format != "auto" && wish.format != toString(known.format)) continue;
      stream.pixelFormat = known.theirs;
      stream.size = {static_cast<unsigned>(wish.width), static_cast<unsigned>(wish.height)};
      if (configuration_->validate() == lc::CameraConfiguration::Invalid || stream.pixelFormat != known.theirs ||
          stream.size != lc::Size(static_cast<unsigned>(wish.width), static_cast<unsigned>(wish.height))) {
        if (stream.pixelFormat == known.theirs) offered += "; nearest to it " + stream.toString();
        continue;
      }
      if (const int failed = camera_->configure(configuration_.get()); failed < 0)
        return problem("refuses " + stream.toString(), failed);
      format_ = known.format;
      width_ = wish.width;
      height_ = wish.height;
      stride_bytes_ = static_cast<int>(stream.stride);
      full_range_ = stream.colorSpace && stream.colorSpace->range == lc::ColorSpace::Range::Full;
      return {};
    }
    return Error{ErrorCode::kWrongUse,
                 fmt::format("{}: offers no colour pictures of {}x{}{}; it offers: {}", camera_->id(), wish.width,
                             wish.height, wish.format == "auto" ? std::string() : " as " + wish.format, offered)};
  }

  Result<void> setControls(double fps, const VideoControls& controls, lc::ControlList& list) {
    const auto known = [this](const lc::ControlId& control) { return camera_->controls().count(&control) != 0; };
    const auto missing = [this](const char* what) {
      return Error{ErrorCode::kWrongUse, camera_->id() + ": has no control for " + what};
    };
    if (controls.exposure_us >= 0 && known(lc::controls::AeEnable))
      list.set(lc::controls::AeEnable, controls.exposure_us == 0);
    if (controls.exposure_us == 0 && !known(lc::controls::AeEnable)) return missing("automatic exposure");
    if (controls.exposure_us > 0) {
      if (!known(lc::controls::ExposureTime)) return missing("exposure");
      list.set(lc::controls::ExposureTime, controls.exposure_us);
    }
    if (controls.gain >= 0) {
      if (!known(lc::controls::AnalogueGain)) return missing("gain");
      list.set(lc::controls::AnalogueGain, static_cast<float>(controls.gain));
    }
    if (fps > 0 && known(lc::controls::FrameDurationLimits)) {  // others have one rate
      const int64_t period_us = static_cast<int64_t>(1e6 / fps + 0.5);
      list.set(lc::controls::FrameDurationLimits, lc::Span<const int64_t, 2>({period_us, period_us}));
    }
    return {};
  }

  Result<void> makeRequests() {
    stream_ = configuration_->at(0).stream();
    allocator_ = std::make_unique<lc::FrameBufferAllocator>(camera_);
    if (const int failed = allocator_->allocate(stream_); failed < 0) return problem("gives no buffers", failed);
    for (const auto& buffer : allocator_->buffers(stream_)) {
      for (const lc::FrameBuffer::Plane& plane : buffer->planes()) {
        const size_t length = size_t{plane.offset} + plane.length;
        if (plane.offset == lc::FrameBuffer::Plane::kInvalidOffset || length > kMostBufferBytes)
          return Error{ErrorCode::kUnreachable, camera_->id() + ": its buffers cannot be mapped"};
        void* memory = mmap(nullptr, length, PROT_READ, MAP_SHARED, plane.fd.get(), 0);
        if (memory == MAP_FAILED) return problem("its buffers cannot be mapped", -errno);
        mapped_[buffer.get()].push_back({static_cast<uint8_t*>(memory), length, plane.offset});
      }
      auto request = camera_->createRequest();
      if (!request || request->addBuffer(stream_, buffer.get()) < 0)
        return Error{ErrorCode::kUnreachable, camera_->id() + ": makes no request"};
      requests_.push_back(std::move(request));
    }
    return {};
  }

  Result<std::optional<Picture>> pictureOf(const lc::Request& request) {
    const lc::FrameBuffer* buffer = request.findBuffer(stream_);
    if (buffer == nullptr || request.status() != lc::Request::RequestComplete ||
        buffer->metadata().status != lc::FrameMetadata::FrameSuccess)
      return Error{ErrorCode::kBadData, camera_->id() + ": the device says that a picture is damaged"};
    const lc::FrameMetadata& told = buffer->metadata();
    Picture picture{format_,       width_, height_, stride_bytes_, full_range_, static_cast<int64_t>(told.timestamp),
                    told.sequence, {}};
    const auto& planes = mapped_.at(buffer);
    for (size_t i = 0; i < planes.size() && i < told.planes().size(); ++i) {
      const size_t used = std::min<size_t>(told.planes()[i].bytesused, planes[i].length - planes[i].offset);
      const uint8_t* from = planes[i].memory + planes[i].offset;
      picture.bytes.insert(picture.bytes.end(), from, from + used);
    }
    return std::optional<Picture>(std::move(picture));
  }

  // On libcamera's thread.
  void completed(lc::Request* request) {
    if (request->status() == lc::Request::RequestCancelled) return;  // at the end of the stream
    const std::lock_guard lock(mutex_);
    done_.push_back(request);
    bell_.notify_one();
  }
  void disconnected() {
    const std::lock_guard lock(mutex_);
    gone_ = true;
    bell_.notify_one();
  }

  std::shared_ptr<lc::Camera> camera_;
  std::unique_ptr<lc::CameraConfiguration> configuration_;
  lc::Stream* stream_ = nullptr;
  std::unique_ptr<lc::FrameBufferAllocator> allocator_;
  std::map<const lc::FrameBuffer*, std::vector<Plane>> mapped_;
  std::vector<std::unique_ptr<lc::Request>> requests_;
  PixelFormat format_ = PixelFormat::kYuyv;
  int width_ = 0, height_ = 0, stride_bytes_ = 0;
  bool full_range_ = false, acquired_ = false, started_ = false;
  std::mutex mutex_;
  std::condition_variable bell_;
  std::deque<lc::Request*> done_;
  bool gone_ = false;
};

}  // namespace

bool hasLibcamera() { return true; }

Result<std::unique_ptr<PictureStream>> openLibcamera(const std::string& id, const VideoWish& wish,
                                                     const VideoControls& controls) {
  if (wish.kind != PictureKind::kColour)
    return Error{ErrorCode::kWrongUse, "libcamera:" + id + ": gives colour, no depth"};
  auto camera = find(id);
  if (!camera) return camera.error();
  auto stream = std::make_unique<LibcameraStream>(std::move(*camera));
  if (auto started = stream->start(wish, controls); !started) return started.error();
  return std::unique_ptr<PictureStream>(std::move(stream));
}

std::vector<std::string> libcameraFound() {
  auto all = manager();
  if (!all) return {all.error().text};
  std::vector<std::string> lines;
  for (const auto& camera : (*all)->cameras()) {
    lines.push_back("libcamera " + camera->id());
    const auto configuration = camera->generateConfiguration({lc::StreamRole::Viewfinder});
    if (configuration && !configuration->empty()) lines.push_back("  " + offeredBy(configuration->at(0)));
  }
  return lines;
}

}  // namespace comap
