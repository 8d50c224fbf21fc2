#include "edge_agent/capture/v4l2_stream.h"

#include <linux/videodev2.h>
#include <poll.h>
#include <spdlog/fmt/fmt.h>

#include <cerrno>
#include <cstddef>
#include <cstring>

#include "edge_agent/capture/v4l2_controls.h"
#include "edge_agent/capture/v4l2_format.h"

namespace comap {
namespace {

constexpr uint32_t kBuffers = 4, kMostBuffers = 32;
constexpr size_t kMostBufferBytes = size_t{256} << 20;

struct Buffer {
  uint8_t* memory = nullptr;
  size_t length = 0;
};

// What the kernel is told of a buffer and tells of it, through either interface; of several planes the first is all.
class BufferTalk {
 public:
  BufferTalk(uint32_t type, uint32_t index) : multi_plane_(type == V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE) {
    buffer.type = type;
    buffer.memory = V4L2_MEMORY_MMAP;
    buffer.index = index;
    if (!multi_plane_) return;
    buffer.m.planes = &plane_;
    buffer.length = 1;
  }
  BufferTalk(const BufferTalk&) = delete;
  BufferTalk& operator=(const BufferTalk&) = delete;

  uint32_t length() const { return multi_plane_ ? plane_.length : buffer.length; }
  uint32_t offset() const { return multi_plane_ ? plane_.m.mem_offset : buffer.m.offset; }
  size_t begin() const { return multi_plane_ ? plane_.data_offset : 0; }  // of the picture, after what precedes it
  size_t end() const { return multi_plane_ ? plane_.bytesused : buffer.bytesused; }

  v4l2_buffer buffer{};

 private:
  const bool multi_plane_;
  v4l2_plane plane_{};
};

Error gone(const std::string& path, const std::string& doing, int failed) {
  return {ErrorCode::kUnreachable, path + ": " + doing + ": " + std::strerror(-failed)};
}

class V4l2Stream final : public PictureStream {
 public:
  V4l2Stream(VideoCalls& calls, std::string path, int descriptor)
      : calls_(calls), path_(std::move(path)), descriptor_(descriptor) {}

  ~V4l2Stream() override {
    auto type = static_cast<int>(type_);
    if (streaming_) calls_.control(descriptor_, VIDIOC_STREAMOFF, &type);
    for (const Buffer& buffer : buffers_) calls_.unmap(buffer.memory, buffer.length);
    calls_.close(descriptor_);
  }

  Result<void> start(const VideoWish& wish, const VideoControls& controls) {
    auto offer = askOffer(calls_, descriptor_, path_);
    if (!offer) return offer.error();
    auto mode = chooseMode(*offer, wish);
    if (!mode) return mode.error();
    card_ = offer->card;
    if (offer->multi_plane) type_ = V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE;
    if (auto set = setMode(*mode, wish.fps); !set) return set;
    if (auto set = setControls(calls_, descriptor_, path_, controls); !set) return set;
    v4l2_event_subscription changes{};
    changes.type = V4L2_EVENT_SOURCE_CHANGE;
    calls_.control(descriptor_, VIDIOC_SUBSCRIBE_EVENT, &changes);  // devices whose format never changes refuse
    if (auto shared = shareBuffers(); !shared) return shared;
    auto type = static_cast<int>(type_);
    if (const int failed = calls_.control(descriptor_, VIDIOC_STREAMON, &type); failed != 0)
      return gone(path_, "does not start", failed);
    streaming_ = true;
    return {};
  }

  Result<std::optional<Picture>> take(std::chrono::milliseconds timeout) override {
    const int ready = calls_.wait(descriptor_, timeout);
    if (ready == 0) return std::optional<Picture>();
    if (ready < 0) return gone(path_, "cannot be waited for", ready);
    if ((ready & POLLPRI) != 0 && sourceChanged())
      return Error{ErrorCode::kUnreachable, path_ + ": has changed its format"};
    if ((ready & POLLIN) == 0) {
      if ((ready & (POLLERR | POLLHUP | POLLNVAL)) != 0)
        return Error{ErrorCode::kUnreachable, path_ + ": is gone or has stopped"};
      return std::optional<Picture>();
    }
    return dequeue();
  }

  std::string description() const override {
    return fmt::format("{} ({}), {} {}x{}{}", path_, card_, toString(format_), width_, height_,
                       fps_ > 0 ? fmt::format(", {:.4g} fps", fps_) : std::string());
  }

 private:
  Result<void> setMode(const VideoMode& mode, double fps) {
    v4l2_format format{};
    format.type = type_;
    const bool multi_plane = type_ == V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE;
    v4l2_pix_format& pix = format.fmt.pix;
    v4l2_pix_format_mplane& planes = format.fmt.pix_mp;  // size, format and field stand in the same places in both
    static_assert(offsetof(v4l2_pix_format, pixelformat) == offsetof(v4l2_pix_format_mplane, pixelformat));
    static_assert(offsetof(v4l2_pix_format, field) == offsetof(v4l2_pix_format_mplane, field));
    pix.width = static_cast<uint32_t>(mode.width);
    pix.height = static_cast<uint32_t>(mode.height);
    pix.pixelformat = mode.fourcc;
    pix.field = V4L2_FIELD_NONE;
    if (multi_plane) planes.num_planes = 1;
    if (const int failed = calls_.control(descriptor_, VIDIOC_S_FMT, &format); failed != 0)
      return gone(path_, failed == -EBUSY ? "another program streams from it" : "refuses " + toString(mode), failed);
    if (pix.pixelformat != mode.fourcc || pix.width != static_cast<uint32_t>(mode.width) ||
        pix.height != static_cast<uint32_t>(mode.height)) {
      VideoMode found = mode;
      found.fourcc = pix.pixelformat;
      found.width = found.min_width = static_cast<int>(pix.width);
      found.height = found.min_height = static_cast<int>(pix.height);
      found.max_fps = 0;
      return Error{ErrorCode::kWrongUse,
                   path_ + ": gives " + toString(found) + " where " + toString(mode) + " was asked for"};
    }
    if (multi_plane && planes.num_planes != 1)
      return Error{ErrorCode::kWrongUse, path_ + ": gives " + toString(mode) + " in " +
                                             std::to_string(planes.num_planes) + " planes, expected 1"};
    format_ = *mode.format;
    width_ = mode.width;
    height_ = mode.height;
    stride_bytes_ = static_cast<int>(multi_plane ? planes.plane_fmt[0].bytesperline : pix.bytesperline);
    full_range_ = (multi_plane ? planes.quantization : pix.quantization) == V4L2_QUANTIZATION_FULL_RANGE;
    v4l2_streamparm rate{};
    rate.type = type_;
    if (fps > 0) {
      rate.parm.capture.timeperframe = {1000, static_cast<uint32_t>(fps * 1000 + 0.5)};
      calls_.control(descriptor_, VIDIOC_S_PARM, &rate);  // one rate only is no fault; what holds is asked below
    }
    rate = {};
    rate.type = type_;
    if (calls_.control(descriptor_, VIDIOC_G_PARM, &rate) == 0 && rate.parm.capture.timeperframe.numerator > 0)
      fps_ = static_cast<double>(rate.parm.capture.timeperframe.denominator) / rate.parm.capture.timeperframe.numerator;
    return {};
  }

  Result<void> shareBuffers() {
    v4l2_requestbuffers request{};
    request.count = kBuffers;
    request.type = type_;
    request.memory = V4L2_MEMORY_MMAP;
    if (const int failed = calls_.control(descriptor_, VIDIOC_REQBUFS, &request); failed != 0)
      return gone(path_, failed == -EBUSY ? "another program streams from it" : "gives no buffers", failed);
    if (request.count < 2 || request.count > kMostBuffers)
      return Error{ErrorCode::kUnreachable, path_ + ": gives " + std::to_string(request.count) +
                                                " buffers, expected 2 to " + std::to_string(kMostBuffers)};
    for (uint32_t i = 0; i < request.count; ++i) {
      BufferTalk told(type_, i);
      if (const int failed = calls_.control(descriptor_, VIDIOC_QUERYBUF, &told.buffer); failed != 0)
        return gone(path_, "does not tell of buffer " + std::to_string(i), failed);
      if (told.length() == 0 || told.length() > kMostBufferBytes)
        return Error{ErrorCode::kUnreachable, path_ + ": has buffers of " + std::to_string(told.length()) + " bytes"};
      void* memory = calls_.map(descriptor_, told.length(), told.offset());
      if (memory == nullptr) return gone(path_, "buffer " + std::to_string(i) + " cannot be mapped", -errno);
      buffers_.push_back({static_cast<uint8_t*>(memory), told.length()});
      if (auto queued = queue(i); !queued) return queued;
    }
    return {};
  }

  Result<void> queue(uint32_t index) {
    BufferTalk told(type_, index);
    if (const int failed = calls_.control(descriptor_, VIDIOC_QBUF, &told.buffer); failed != 0)
      return gone(path_, "takes no buffer back", failed);
    return {};
  }

  Result<std::optional<Picture>> dequeue() {
    BufferTalk told(type_, 0);
    const v4l2_buffer& buffer = told.buffer;
    const int failed = calls_.control(descriptor_, VIDIOC_DQBUF, &told.buffer);
    if (failed == -EAGAIN) return std::optional<Picture>();
    if (failed == -EIO) return Error{ErrorCode::kBadData, path_ + ": a picture was lost on the way"};
    if (failed != 0) return gone(path_, "gives no pictures", failed);
    if (buffer.index >= buffers_.size())
      return Error{ErrorCode::kUnreachable, path_ + ": returns buffer " + std::to_string(buffer.index) + " of " +
                                                std::to_string(buffers_.size())};
    const Buffer& shared = buffers_[buffer.index];
    const bool damaged = (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0;
    const bool fits = told.begin() <= told.end() && told.end() <= shared.length;
    Picture picture{format_, width_, height_, stride_bytes_, full_range_, 0, buffer.sequence, {}};
    if ((buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC)
      picture.stamp_ns = int64_t{buffer.timestamp.tv_sec} * 1'000'000'000 + int64_t{buffer.timestamp.tv_usec} * 1000;
    if (!damaged && fits) picture.bytes.assign(shared.memory + told.begin(), shared.memory + told.end());
    if (auto queued = queue(buffer.index); !queued) return queued.error();
    if (damaged) return Error{ErrorCode::kBadData, path_ + ": the device says that a picture is damaged"};
    if (!fits)
      return Error{ErrorCode::kBadData, path_ + ": a picture of " + std::to_string(told.end()) + " bytes from byte " +
                                            std::to_string(told.begin()) + " in a buffer of " +
                                            std::to_string(shared.length)};
    return std::optional<Picture>(std::move(picture));
  }

  bool sourceChanged() {
    v4l2_event event{};
    return calls_.control(descriptor_, VIDIOC_DQEVENT, &event) == 0 && event.type == V4L2_EVENT_SOURCE_CHANGE &&
           (event.u.src_change.changes & V4L2_EVENT_SRC_CH_RESOLUTION) != 0;
  }

  VideoCalls& calls_;
  std::string path_, card_;
  int descriptor_;
  uint32_t type_ = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  bool streaming_ = false;
  PixelFormat format_ = PixelFormat::kYuyv;
  int width_ = 0, height_ = 0, stride_bytes_ = 0;
  bool full_range_ = false;
  double fps_ = 0;
  std::vector<Buffer> buffers_;
};

}  // namespace

Result<std::unique_ptr<PictureStream>> openV4l2(VideoCalls& calls, const std::string& path, const VideoWish& wish,
                                                const VideoControls& controls) {
  const int descriptor = calls.open(path);
  if (descriptor < 0) return Error{ErrorCode::kUnreachable, path + ": cannot be opened: " + std::strerror(-descriptor)};
  auto stream = std::make_unique<V4l2Stream>(calls, path, descriptor);
  if (auto started = stream->start(wish, controls); !started) return started.error();
  return std::unique_ptr<PictureStream>(std::move(stream));
}

}  // namespace comap
