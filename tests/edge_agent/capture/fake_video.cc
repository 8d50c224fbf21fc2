#include "tests/edge_agent/capture/fake_video.h"

#include <poll.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace comap {

void FakeVideo::plug(const std::string& path, FakeDevice device) {
  const std::lock_guard lock(mutex_);
  devices_[path] = std::make_shared<FakeDevice>(std::move(device));
}

void FakeVideo::unplug(const std::string& path) {
  const std::lock_guard lock(mutex_);
  devices_.erase(path);
  bell_.notify_all();
}

void FakeVideo::deliver(const std::string& path, FakePicture picture) {
  const std::lock_guard lock(mutex_);
  devices_.at(path)->waiting.push_back(std::move(picture));
  bell_.notify_all();
}

void FakeVideo::failNext(const std::string& path, int error) {
  const std::lock_guard lock(mutex_);
  devices_.at(path)->failures.push_back(error);
  bell_.notify_all();
}

void FakeVideo::changeSource(const std::string& path) {
  const std::lock_guard lock(mutex_);
  devices_.at(path)->changed = true;
  bell_.notify_all();
}

FakeDevice FakeVideo::look(const std::string& path) const {
  const std::lock_guard lock(mutex_);
  return *devices_.at(path);
}

int FakeVideo::openDescriptors() const {
  const std::lock_guard lock(mutex_);
  return static_cast<int>(opened_.size());
}

int FakeVideo::mappings() const {
  const std::lock_guard lock(mutex_);
  return mappings_;
}

bool FakeVideo::gone(const Opened& opened) const {
  const auto found = devices_.find(opened.path);
  return found == devices_.end() || found->second != opened.device;
}

int FakeVideo::open(const std::string& path) {
  const std::lock_guard lock(mutex_);
  const auto found = devices_.find(path);
  if (found == devices_.end()) return -ENOENT;
  opened_[next_descriptor_] = {path, found->second, {}, {}};
  return next_descriptor_++;
}

void FakeVideo::close(int descriptor) {
  const std::lock_guard lock(mutex_);
  opened_.erase(descriptor);
}

bool FakeVideo::isMultiPlane(const FakeDevice& device) {
  return (device.capabilities & V4L2_CAP_VIDEO_CAPTURE_MPLANE) != 0;
}

uint32_t FakeVideo::typeOf(const FakeDevice& device) {
  return isMultiPlane(device) ? V4L2_BUF_TYPE_VIDEO_CAPTURE_MPLANE : V4L2_BUF_TYPE_VIDEO_CAPTURE;
}

int FakeVideo::setFormat(Opened& opened, v4l2_format& format) {
  FakeDevice& device = *opened.device;
  if (device.busy) return -EBUSY;
  if (format.type != typeOf(device)) return -EINVAL;
  if (isMultiPlane(device)) {
    v4l2_pix_format_mplane& planes = format.fmt.pix_mp;
    planes.num_planes = device.planes;
    planes.plane_fmt[0].bytesperline = device.multi_plane_stride;
    device.width = planes.width;
    device.height = planes.height;
    device.fourcc = planes.pixelformat;
    return 0;
  }
  v4l2_pix_format& pix = format.fmt.pix;
  if (device.forced_width != 0) pix.width = device.forced_width;
  const bool compressed = pix.pixelformat == V4L2_PIX_FMT_MJPEG;
  const bool planar = pix.pixelformat == V4L2_PIX_FMT_NV12;
  const bool rgb = pix.pixelformat == V4L2_PIX_FMT_RGB24 || pix.pixelformat == V4L2_PIX_FMT_BGR24;
  pix.bytesperline = compressed ? 0 : pix.width * (planar ? 1 : rgb ? 3 : 2);
  device.width = pix.width;
  device.height = pix.height;
  device.fourcc = pix.pixelformat;
  return 0;
}

int FakeVideo::dequeue(Opened& opened, v4l2_buffer& buffer) {
  FakeDevice& device = *opened.device;
  if (!device.failures.empty()) {
    const int error = device.failures.front();
    device.failures.pop_front();
    return -error;
  }
  if (device.waiting.empty() || opened.queued.empty()) return -EAGAIN;
  const FakePicture picture = device.waiting.front();
  device.waiting.pop_front();
  buffer.index = opened.queued.front();
  opened.queued.pop_front();
  std::vector<uint8_t>& memory = opened.memory[buffer.index];
  std::copy_n(picture.bytes.begin(), std::min(picture.bytes.size(), memory.size()), memory.begin());
  const uint32_t used = picture.bytes_used != 0 ? picture.bytes_used : static_cast<uint32_t>(picture.bytes.size());
  (isMultiPlane(device) ? buffer.m.planes[0].bytesused : buffer.bytesused) = used;
  if (isMultiPlane(device)) buffer.m.planes[0].data_offset = device.data_offset;
  buffer.flags = picture.flags;
  buffer.sequence = picture.sequence;
  buffer.timestamp.tv_sec = picture.stamp_ns / 1'000'000'000;
  buffer.timestamp.tv_usec = picture.stamp_ns % 1'000'000'000 / 1000;
  return 0;
}

int FakeVideo::control(int descriptor, unsigned long request, void* argument) {
  const std::lock_guard lock(mutex_);
  Opened& opened = opened_.at(descriptor);
  if (gone(opened)) return -ENODEV;
  FakeDevice& device = *opened.device;
  const bool buffers = request == VIDIOC_QUERYBUF || request == VIDIOC_QBUF || request == VIDIOC_DQBUF;
  if (buffers) {
    const auto& buffer = *static_cast<v4l2_buffer*>(argument);
    if (buffer.type != typeOf(device) || (isMultiPlane(device) && (buffer.length != 1 || buffer.m.planes == nullptr)))
      return -EINVAL;
  }
  switch (request) {
    case VIDIOC_QUERYCAP: {
      auto& told = *static_cast<v4l2_capability*>(argument);
      std::strncpy(reinterpret_cast<char*>(told.card), device.card.c_str(), sizeof told.card - 1);
      std::strcpy(reinterpret_cast<char*>(told.bus_info), "fake-1");
      told.capabilities = device.capabilities | V4L2_CAP_DEVICE_CAPS;
      told.device_caps = device.capabilities;
      return 0;
    }
    case VIDIOC_ENUM_FMT: {
      auto& told = *static_cast<v4l2_fmtdesc*>(argument);
      std::vector<uint32_t> formats;
      for (const FakeMode& mode : device.modes)
        if (std::find(formats.begin(), formats.end(), mode.fourcc) == formats.end()) formats.push_back(mode.fourcc);
      if (told.index >= formats.size() || told.type != typeOf(device)) return -EINVAL;
      told.pixelformat = formats[told.index];
      return 0;
    }
    case VIDIOC_ENUM_FRAMESIZES: {
      auto& told = *static_cast<v4l2_frmsizeenum*>(argument);
      uint32_t index = 0;
      for (const FakeMode& mode : device.modes) {
        if (mode.fourcc != told.pixel_format || index++ != told.index) continue;
        told.type = V4L2_FRMSIZE_TYPE_DISCRETE;
        told.discrete = {mode.width, mode.height};
        return 0;
      }
      return -EINVAL;
    }
    case VIDIOC_ENUM_FRAMEINTERVALS: {
      auto& told = *static_cast<v4l2_frmivalenum*>(argument);
      for (const FakeMode& mode : device.modes) {
        if (mode.fourcc != told.pixel_format || mode.width != told.width || mode.height != told.height) continue;
        if (told.index > 0) return -EINVAL;
        told.type = V4L2_FRMIVAL_TYPE_DISCRETE;
        told.discrete = {1, mode.fps};
        return 0;
      }
      return -EINVAL;
    }
    case VIDIOC_S_FMT:
      return setFormat(opened, *static_cast<v4l2_format*>(argument));
    case VIDIOC_S_PARM:
    case VIDIOC_SUBSCRIBE_EVENT:
      return 0;
    case VIDIOC_G_PARM:
      static_cast<v4l2_streamparm*>(argument)->parm.capture.timeperframe = {1, 30};
      return 0;
    case VIDIOC_QUERYCTRL: {
      auto& told = *static_cast<v4l2_queryctrl*>(argument);
      const auto found = device.controls.find(told.id);
      if (found == device.controls.end()) return -EINVAL;
      told = found->second;
      return 0;
    }
    case VIDIOC_S_CTRL: {
      const auto& set = *static_cast<v4l2_control*>(argument);
      device.controls.at(set.id).default_value = set.value;
      return 0;
    }
    case VIDIOC_REQBUFS: {
      auto& asked = *static_cast<v4l2_requestbuffers*>(argument);
      if (device.busy) return -EBUSY;
      if (asked.type != typeOf(device)) return -EINVAL;
      opened.memory.assign(asked.count, std::vector<uint8_t>(device.buffer_bytes));
      return 0;
    }
    case VIDIOC_QUERYBUF: {
      auto& buffer = *static_cast<v4l2_buffer*>(argument);
      if (buffer.index >= opened.memory.size()) return -EINVAL;
      (isMultiPlane(device) ? buffer.m.planes[0].length : buffer.length) = device.buffer_bytes;
      (isMultiPlane(device) ? buffer.m.planes[0].m.mem_offset : buffer.m.offset) = buffer.index * device.buffer_bytes;
      return 0;
    }
    case VIDIOC_QBUF: {
      opened.queued.push_back(static_cast<v4l2_buffer*>(argument)->index);
      bell_.notify_all();
      return 0;
    }
    case VIDIOC_DQBUF:
      return dequeue(opened, *static_cast<v4l2_buffer*>(argument));
    case VIDIOC_DQEVENT: {
      auto& event = *static_cast<v4l2_event*>(argument);
      if (!device.changed) return -ENOENT;
      device.changed = false;
      event.type = V4L2_EVENT_SOURCE_CHANGE;
      event.u.src_change.changes = V4L2_EVENT_SRC_CH_RESOLUTION;
      return 0;
    }
    case VIDIOC_STREAMON:
      if (*static_cast<int*>(argument) != static_cast<int>(typeOf(device))) return -EINVAL;
      device.streaming = true;
      return 0;
    case VIDIOC_STREAMOFF:
      if (*static_cast<int*>(argument) != static_cast<int>(typeOf(device))) return -EINVAL;
      device.streaming = false;
      return 0;
    default:
      return -ENOTTY;
  }
}

void* FakeVideo::map(int descriptor, size_t /*length*/, int64_t offset) {
  const std::lock_guard lock(mutex_);
  Opened& opened = opened_.at(descriptor);
  ++mappings_;
  return opened.memory.at(static_cast<size_t>(offset) / opened.device->buffer_bytes).data();
}

void FakeVideo::unmap(void* /*memory*/, size_t /*length*/) {
  const std::lock_guard lock(mutex_);
  --mappings_;
}

int FakeVideo::wait(int descriptor, std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  Opened& opened = opened_.at(descriptor);
  const auto news = [&] {
    const FakeDevice& device = *opened.device;
    return gone(opened) || device.changed || !device.failures.empty() ||
           (!device.waiting.empty() && !opened.queued.empty());
  };
  if (!bell_.wait_for(lock, timeout, news)) return 0;
  if (gone(opened)) return POLLERR | POLLHUP;
  return opened.device->changed ? POLLPRI : POLLIN;
}

std::vector<std::string> FakeVideo::nodes() {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> paths;
  for (const auto& [path, device] : devices_) paths.push_back(path);
  return paths;
}

}  // namespace comap
