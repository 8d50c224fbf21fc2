// Recordings of OpenNI2.
#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include "edge_agent/capture/frame_maker.h"
#include "edge_agent/capture/openni2.h"
#include "edge_agent/capture/openni2_device.h"

namespace comap {
namespace {

using namespace openni2_detail;

constexpr int kPatience_ms = 5000;

// One of the two streams of the file, picture by picture.
class Track {
 public:
  Track(ReadyStream ready, int count) : ready_(std::move(ready)), count_(count) {}
  ~Track() {
    if (ready_.stream) {
      ready_.stream->stop();
      ready_.stream->destroy();
    }
  }
  Track(Track&&) = default;
  Track& operator=(Track&&) = delete;

  bool start() { return ready_.stream->start() == openni::STATUS_OK; }
  size_t count() const { return static_cast<size_t>(count_); }
  bool ended() const { return index_ >= count_; }

  Result<Picture> read(const std::string& path) {
    openni::VideoStream* stream = ready_.stream.get();
    int which = 0;
    openni::VideoFrameRef frame;
    if (openni::OpenNI::waitForAnyStream(&stream, 1, &which, kPatience_ms) != openni::STATUS_OK ||
        stream->readFrame(&frame) != openni::STATUS_OK) {
      const int last = std::exchange(index_, count_);
      return problem(ErrorCode::kBadData, fmt::format("{}: ends after picture {} of {}", path, last, count_));
    }
    if (frame.getFrameIndex() <= index_) {
      index_ = count_;
      return Error{ErrorCode::kBadData, path + ": its pictures are not in order"};
    }
    index_ = frame.getFrameIndex();
    return pictureOf(frame, ready_.format);
  }

 private:
  ReadyStream ready_;
  int count_ = 0, index_ = 0;
};

class OniSource final : public FrameSource {
 public:
  OniSource(std::string path, std::shared_ptr<Device> device, Track colour, Track depth, FrameMaker maker,
            int64_t max_gap_ns)
      : path_(std::move(path)),
        device_(std::move(device)),
        colour_(std::move(colour)),
        depth_(std::move(depth)),
        maker_(std::move(maker)),
        max_gap_ns_(max_gap_ns) {}

  Result<std::optional<Frame>> next() override {
    std::optional<Picture> colour, depth;
    while (true) {
      if (!depth) {
        if (depth_.ended()) return std::optional<Frame>();
        auto read = depth_.read(path_);
        if (!read) return read.error();
        depth = std::move(*read);
      }
      if (!colour) {
        if (colour_.ended()) return std::optional<Frame>();
        auto read = colour_.read(path_);
        if (!read) return read.error();
        colour = std::move(*read);
      }
      const int64_t ahead_ns = colour->stamp_ns - depth->stamp_ns;
      if (std::abs(ahead_ns) <= max_gap_ns_) break;
      (ahead_ns > 0 ? depth : colour).reset();  // the earlier one has no partner
    }
    auto frame = maker_.make({std::move(*colour), std::move(*depth)});
    if (!frame) return Error{frame.error().code, path_ + ": " + frame.error().text};
    return std::optional<Frame>(std::move(*frame));
  }

  size_t size() const override { return std::min(colour_.count(), depth_.count()); }
  std::string description() const override {
    return fmt::format("OpenNI2 recording {}, {} frames, {}x{}", path_, size(), maker_.camera().width,
                       maker_.camera().height);
  }

 private:
  std::string path_;
  std::shared_ptr<Device> device_;
  Track colour_, depth_;
  FrameMaker maker_;
  int64_t max_gap_ns_;
};

}  // namespace

Result<std::unique_ptr<FrameSource>> openOniFile(const std::string& path, const CameraConfig& config) {
  std::error_code ignored;
  if (std::filesystem::exists(path, ignored) && !std::filesystem::is_regular_file(path, ignored))
    return Error{ErrorCode::kUnreachable, path + ": is no file"};
  if (access(path.c_str(), R_OK) != 0)
    return Error{ErrorCode::kUnreachable, path + ": cannot be read: " + std::strerror(errno)};
  auto device = Device::open(path);
  if (!device)
    return Error{ErrorCode::kBadData,
                 path + ": is no recording of OpenNI2, or it was cut off before it was closed: " + device.error().text};
  openni::PlaybackControl* playback = (*device)->device().getPlaybackControl();
  if (playback == nullptr) return Error{ErrorCode::kBadData, path + ": is no recording of OpenNI2"};
  playback->setSpeed(-1);  // picture by picture, as they are asked for
  playback->setRepeatEnabled(false);
  auto colour = prepare(**device, {PictureKind::kColour});
  if (!colour) return Error{ErrorCode::kBadData, colour.error().text};
  auto depth = prepare(**device, {PictureKind::kDepth});
  if (!depth) return Error{ErrorCode::kBadData, depth.error().text};
  CameraRig rig = config.rig;
  rig.depth_units_per_m = depth->units_per_m;
  const Lens colour_lens = lensOf(*colour->stream), depth_lens = lensOf(*depth->stream);
  if (rig.colour.pinhole.fx <= 0) rig.colour = colour_lens;
  if (rig.depth.pinhole.fx <= 0) rig.depth = depth_lens;
  // Most recordings do not say whether their depth was registered, and count as not: through one lens and from one
  // place it is the same.
  const bool registered = config.registration == "device" ||
                          (config.registration == "auto" &&
                           (*device)->device().getImageRegistrationMode() == openni::IMAGE_REGISTRATION_DEPTH_TO_COLOR);
  if (rig.colour.pinhole.fx <= 0 || (!registered && rig.depth.pinhole.fx <= 0))
    return Error{ErrorCode::kWrongUse,
                 path + ": does not tell its focal lengths: give camera.profile or camera.colour.fx"};
  const int colours = playback->getNumberOfFrames(*colour->stream),
            depths = playback->getNumberOfFrames(*depth->stream);
  Track colour_track(std::move(*colour), colours), depth_track(std::move(*depth), depths);
  if (!depth_track.start() || !colour_track.start()) return problem(ErrorCode::kBadData, path + ": does not start");
  return std::unique_ptr<FrameSource>(
      std::make_unique<OniSource>(path, std::move(*device), std::move(colour_track), std::move(depth_track),
                                  FrameMaker(rig, registered, config.shrink), int64_t{config.pair_gap_ms} * 1'000'000));
}

}  // namespace comap
