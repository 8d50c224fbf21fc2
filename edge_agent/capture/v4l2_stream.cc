#include "edge_agent/capture/v4l2_stream.h"

#include <linux/videodev2.h>
#include <poll.h>
#include <spdlog/fmt/fmt.h>

#include <cerrno>
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

Error gone(const std::string& path, const std::string& doing, int failed) {
  return {ErrorCode::kUnreachable, path + ": " + doing + ": " + std::strerror(-failed)};
}

class V4l2Stream final : public PictureStream {
 public:
  V4l2Stream(VideoCalls& calls, std::string path, int descriptor)
      : calls_(calls), path_(std::move(path)), descriptor_(descriptor) {}

  ~V4l2Stream() override {
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
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
    if (auto set = setMode(*mode, wish.fps); !set) return set;
    if (auto set = setControls(calls_, descriptor_, path_, controls); !set) return set;
    v4l2_event_subscription changes{};
    changes.type = V4L2_EVENT_SOURCE_CHANGE;
    calls_.control(descriptor_, VIDIOC_SUBSCRIBE_EVENT, &changes);  // devices whose format never changes refuse
    if (auto shared = shareBuffers(); !shared) return shared;
    int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
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
    format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    v4l2_pix_format& pix = format.fmt.pix;
    pix.width = static_cast<uint32_t>(mode.width);
    pix.height = static_cast<uint32_t>(mode.height);
    pix.pixelformat = mode.fourcc;
    pix.field = V4L2_FIELD_NONE;
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
    format_ = *mode.format;
    width_ = mode.width;
    height_ = mode.height;
    stride_bytes_ = static_cast<int>(pix.bytesperline);
    full_range_ = pix.quantization == V4L2_QUANTIZATION_FULL_RANGE;
    v4l2_streamparm rate{};
    rate.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (fps > 0) {
      rate.parm.capture.timeperframe = {1000, static_cast<uint32_t>(fps * 1000 + 0.5)};
      calls_.control(descriptor_, VIDIOC_S_PARM, &rate);  // one rate only is no fault; what holds is asked below
    }
    rate = {};
    rate.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (calls_.control(descriptor_, VIDIOC_G_PARM, &rate) == 0 && rate.parm.capture.timeperframe.numerator > 0)
      fps_ = static_cast<double>(rate.parm.capture.timeperframe.denominator) / rate.parm.capture.timeperframe.numerator;
    return {};
  }

  Result<void> shareBuffers() {
    v4l2_requestbuffers request{};
    request.count = kBuffers;
    request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    request.memory = V4L2_MEMORY_MMAP;
    if (const int failed = calls_.control(descriptor_, VIDIOC_REQBUFS, &request); failed != 0)
      return gone(path_, failed == -EBUSY ? "another program streams from it" : "gives no buffers", failed);
    if (request.count < 2 || request.count > kMostBuffers)
      return Error{ErrorCode::kUnreachable, path_ + ": gives " + std::to_string(request.count) +
                                                " buffers, expected 2 to " + std::to_string(kMostBuffers)};
    for (uint32_t i = 0; i < request.count; ++i) {
      v4l2_buffer buffer = bufferOf(i);
      if (const int failed = calls_.control(descriptor_, VIDIOC_QUERYBUF, &buffer); failed != 0)
        return gone(path_, "does not tell of buffer " + std::to_string(i), failed);
      if (buffer.length == 0 || buffer.length > kMostBufferBytes)
        return Error{ErrorCode::kUnreachable, path_ + ": has buffers of " + std::to_string(buffer.length) + " bytes"};
      void* memory = calls_.map(descriptor_, buffer.length, buffer.m.offset);
      if (memory == nullptr) return gone(path_, "buffer " + std::to_string(i) + " cannot be mapped", -errno);
      buffers_.push_back({static_cast<uint8_t*>(memory), buffer.length});
      if (auto queued = queue(buffer); !queued) return queued;
    }
    return {};
  }

  static v4l2_buffer bufferOf(uint32_t index) {
    v4l2_buffer buffer{};
    buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer.memory = V4L2_MEMORY_MMAP;
    buffer.index = index;
    return buffer;
  }

  Result<void> queue(v4l2_buffer& buffer) {
    if (const int failed = calls_.control(descriptor_, VIDIOC_QBUF, &buffer); failed != 0)
      return gone(path_, "takes no buffer back", failed);
    return {};
  }

  Result<std::optional<Picture>> dequeue() {
    v4l2_buffer buffer = bufferOf(0);
    const int failed = calls_.control(descriptor_, VIDIOC_DQBUF, &buffer);
    if (failed == -EAGAIN) return std::optional<Picture>();
    if (failed == -EIO) return Error{ErrorCode::kBadData, path_ + ": a picture was lost on the way"};
    if (failed != 0) return gone(path_, "gives no pictures", failed);
    if (buffer.index >= buffers_.size())
      return Error{ErrorCode::kUnreachable, path_ + ": returns buffer " + std::to_string(buffer.index) + " of " +
                                                std::to_string(buffers_.size())};
    const Buffer& shared = buffers_[buffer.index];
    const bool damaged = (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0;
    const size_t used = buffer.bytesused;
    Picture picture{format_, width_, height_, stride_bytes_, full_range_, 0, buffer.sequence, {}};
    if ((buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC)
      picture.stamp_ns = int64_t{buffer.timestamp.tv_sec} * 1'000'000'000 + int64_t{buffer.timestamp.tv_usec} * 1000;
    if (!damaged && used <= shared.length) picture.bytes.assign(shared.memory, shared.memory + used);
    v4l2_buffer again = bufferOf(buffer.index);
    if (auto queued = queue(again); !queued) return queued.error();
    if (damaged) return Error{ErrorCode::kBadData, path_ + ": the device says that a picture is damaged"};
    if (used > shared.length)
      return Error{ErrorCode::kBadData, path_ + ": a picture of " + std::to_string(used) + " bytes in a buffer of " +
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
