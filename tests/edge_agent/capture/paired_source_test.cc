#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>

#include "edge_agent/capture/camera_source.h"
#include "edge_agent/capture/capture_commands.h"
#include "edge_agent/capture/device_clock.h"
#include "edge_agent/capture/image_codec.h"
#include "edge_agent/capture/image_file.h"
#include "edge_agent/capture/source_uri.h"
#include "tests/edge_agent/capture/fake_video.h"
#include "tests/files/temporary_folder.h"
#include "tests/scenes/scene.h"

namespace comap {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

constexpr char kColour[] = "/dev/video2", kDepth[] = "/dev/video0";
constexpr int64_t kMs = 1'000'000;
constexpr milliseconds kLong{20'000};

FakeDevice camera(uint32_t fourcc) {
  FakeDevice device;
  device.modes = {{fourcc, 320, 240, 30}};
  device.buffer_bytes = 320 * 240 * 3;
  return device;
}

// A camera whose two eyes share one place and lens, in front of a scene.
class PairedSourceTest : public testing::Test {
 protected:
  PairedSourceTest() {
    plugColour();
    plugDepth();
    config_.rig.colour.pinhole = config_.rig.depth.pinhole = smallCamera();
    config_.registration = "device";
    config_.hot_celsius = 0;  // however hot the machine is that runs this
    frame_ = Scene::room().render(smallCamera(), Pose());
    for (size_t i = 0; i < frame_.depth.size(); ++i)
      frame_.depth.data()[i] = static_cast<uint16_t>(frame_.depth.data()[i] / 5 * 5);
  }

  void plugColour() { video_.plug(kColour, camera(V4L2_PIX_FMT_RGB24)); }
  void plugDepth() { video_.plug(kDepth, camera(V4L2_PIX_FMT_Z16)); }

  std::unique_ptr<FrameSource> open() {
    auto source = openCamera(
        "v4l2", std::string(kColour) + "," + kDepth, config_, [this](const std::string& line) { log_ += line + "\n"; },
        video_);
    EXPECT_TRUE(source) << source.error().text;
    return source ? std::move(*source) : nullptr;
  }

  std::vector<uint8_t> colourBytes() const {
    const auto* bytes = reinterpret_cast<const uint8_t*>(frame_.colour.data());
    return {bytes, bytes + 3 * frame_.colour.size()};
  }
  std::vector<uint8_t> depthBytes() const {
    std::vector<uint8_t> bytes;
    for (size_t i = 0; i < frame_.depth.size(); ++i) {
      const int mm = frame_.depth.data()[i] / 5;
      bytes.push_back(static_cast<uint8_t>(mm));
      bytes.push_back(static_cast<uint8_t>(mm >> 8));
    }
    return bytes;
  }
  void shoot(int64_t colour_ns, int64_t depth_ns) {
    ++sequence_;
    video_.deliver(kDepth, {depthBytes(), sequence_, depth_ns});
    video_.deliver(kColour, {colourBytes(), sequence_, colour_ns});
  }
  void shoot() {
    const int64_t now = monotonicNow_ns() / 1000 * 1000;
    shoot(now, now);
  }

  // Until `true_for` holds of the source's health; the source is asked for frames meanwhile.
  template <class TrueFor>
  bool await(FrameSource& source, TrueFor true_for) {
    const auto until = std::chrono::steady_clock::now() + kLong;
    while (std::chrono::steady_clock::now() < until) {
      source.ready(milliseconds(5));
      if (true_for(*source.health())) return true;
    }
    return false;
  }

  FakeVideo video_;
  CameraConfig config_;
  Frame frame_;
  std::string log_;
  uint32_t sequence_ = 0;
};

TEST_F(PairedSourceTest, GivesWhatBothEyesSaw) {
  auto source = open();
  ASSERT_TRUE(source->live());
  EXPECT_FALSE(source->ready(milliseconds(0)));
  int64_t last = 0;
  for (int i = 0; i < 5; ++i) {
    shoot();
    ASSERT_TRUE(source->ready(kLong));
    const auto next = source->next();
    ASSERT_TRUE(next && *next);
    EXPECT_EQ((*next)->colour, frame_.colour);
    EXPECT_EQ((*next)->depth, frame_.depth);
    EXPECT_EQ((*next)->camera, smallCamera());
    EXPECT_GT((*next)->stamp_ns, last);
    EXPECT_GT((*next)->stamp_ns, 1'600'000'000'000'000'000) << "time since 1970";
    last = (*next)->stamp_ns;
  }
  EXPECT_EQ(source->health()->colour.state, StreamState::kStreaming);
  EXPECT_EQ(source->health()->colour.taken, 5u);
}

TEST_F(PairedSourceTest, TheNewestFrameWins) {
  auto source = open();
  const int64_t now = monotonicNow_ns();
  for (int i = 0; i < 6; ++i) shoot(now - (600 - 100 * i) * kMs, now - (600 - 100 * i) * kMs);
  ASSERT_TRUE(await(*source, [](const CaptureHealth& h) { return h.colour.taken == 6 && h.depth.taken == 6; }));
  ASSERT_TRUE(source->ready(kLong));
  const auto next = source->next();
  ASSERT_TRUE(next && *next);
  EXPECT_EQ(source->health()->overtaken, 5u);
  EXPECT_FALSE(source->ready(milliseconds(0)));
}

TEST_F(PairedSourceTest, AHotMachineTakesFewerFrames) {
  const TemporaryFolder thermal;
  thermal.write("thermal_zone0/temp", "91000\n");
  config_.thermal_folder = thermal.path();
  config_.hot_celsius = 85;
  auto source = open();
  int64_t stamp_ns = monotonicNow_ns() - 20 * 33 * kMs;
  const auto give = [&](uint64_t pictures) {
    for (uint64_t i = 0; i < pictures; ++i, stamp_ns += 33 * kMs) shoot(stamp_ns, stamp_ns);
    ASSERT_TRUE(await(
        *source, [&](const CaptureHealth& h) { return h.colour.taken == sequence_ && h.depth.taken == sequence_; }));
  };
  // The camera's period is learnt from the first pictures; work on the frame ends when the next one is asked for.
  give(4);
  ASSERT_TRUE(source->next());
  EXPECT_EQ(source->health()->every, 1);
  EXPECT_FALSE(source->ready(milliseconds(0)));
  EXPECT_EQ(source->health()->every, 2);
  EXPECT_EQ(source->health()->hottest_C, 91.0);
  EXPECT_THAT(log_, HasSubstr("91 C warm (camera.hot_celsius: 85): one of 2 frames is taken"));
  give(1);
  EXPECT_FALSE(source->ready(milliseconds(0))) << "the next one is left out";
  give(1);
  EXPECT_TRUE(source->ready(kLong));
  EXPECT_EQ(source->health()->overtaken, 4u) << "three of the first four, and one";
}

TEST_F(PairedSourceTest, AnUnpluggedCameraIsWaitedFor) {
  auto source = open();
  shoot();
  ASSERT_TRUE(source->next());
  for (const bool colour : {true, false}) {
    video_.unplug(colour ? kColour : kDepth);
    const auto state = [&](const CaptureHealth& h) { return colour ? h.colour.state : h.depth.state; };
    ASSERT_TRUE(await(*source, [&](const CaptureHealth& h) { return state(h) == StreamState::kGone; }));
    EXPECT_FALSE(source->ready(milliseconds(20)));
    colour ? plugColour() : plugDepth();
    ASSERT_TRUE(await(*source, [&](const CaptureHealth& h) { return state(h) == StreamState::kStarting; }));
    shoot();
    ASSERT_TRUE(source->ready(kLong));
    const auto next = source->next();
    ASSERT_TRUE(next && *next);
    EXPECT_EQ((*next)->colour, frame_.colour);
    EXPECT_EQ(colour ? source->health()->colour.reopened : source->health()->depth.reopened, 1u);
  }
  EXPECT_THAT(log_, HasSubstr("camera: colour gone, it is waited for: /dev/video2"));
  EXPECT_THAT(log_, HasSubstr("camera: colour streaming"));
  EXPECT_THAT(log_, HasSubstr("camera: depth gone"));
}

TEST_F(PairedSourceTest, ACameraThatComesBackAsAnotherIsRefusedUntilItFits) {
  auto source = open();
  video_.unplug(kColour);
  ASSERT_TRUE(await(*source, [&](const CaptureHealth& h) { return h.colour.state == StreamState::kGone; }));
  FakeDevice other = camera(V4L2_PIX_FMT_RGB24);
  other.modes[0].width = 160;
  video_.plug(kColour, other);
  ASSERT_TRUE(await(
      *source, [&](const CaptureHealth& h) { return h.colour.problem.find("offers no colour") != std::string::npos; }));
  EXPECT_EQ(source->health()->colour.state, StreamState::kGone);
  plugColour();
  ASSERT_TRUE(await(*source, [&](const CaptureHealth& h) { return h.colour.state == StreamState::kStarting; }));
}

TEST_F(PairedSourceTest, AChangedResolutionIsSetBack) {
  auto source = open();
  shoot();
  ASSERT_TRUE(source->next());
  video_.changeSource(kColour);
  ASSERT_TRUE(await(*source, [&](const CaptureHealth& h) { return h.colour.reopened == 1; }));
  shoot();
  ASSERT_TRUE(source->ready(kLong));
  EXPECT_TRUE(source->next());
}

TEST_F(PairedSourceTest, StallsAndRepetitionsAreSeen) {
  auto source = open();
  const int64_t stamp = monotonicNow_ns();
  shoot(stamp, stamp);
  ASSERT_TRUE(source->next());
  ASSERT_TRUE(await(*source, [&](const CaptureHealth& h) {
    video_.deliver(kColour, {colourBytes(), 1, stamp / 1000 * 1000});
    return h.colour.state == StreamState::kStalled && h.depth.state == StreamState::kStalled;
  })) << "the same picture again and again is no stream";
  EXPECT_GT(source->health()->colour.repeated, 0u);
  EXPECT_THAT(log_, HasSubstr("camera: colour stalled"));
  shoot();
  ASSERT_TRUE(source->ready(kLong));
  EXPECT_TRUE(source->next());
  EXPECT_TRUE(await(*source, [&](const CaptureHealth& h) {
    shoot();  // again and again: on a busy machine one picture may be a stall ago when its state is asked for
    return h.colour.state == StreamState::kStreaming;
  }));
}

// Pictures of an unbelievable stamp pair by when they arrived. On a busy machine that may be too far apart for a pair,
// or the depth picture so much earlier that another may be nearer: then the camera's next pictures decide.
TEST_F(PairedSourceTest, AClockThatJumpsDoesNotStopIt) {
  auto source = open();
  const auto arrived = [&](const CaptureHealth& h) {
    return h.colour.taken == sequence_ && h.depth.taken == sequence_;
  };
  int64_t last = 0;
  uint64_t unbelievable = 0;
  for (const int64_t off_ns : {int64_t{0}, 3600'000 * kMs, -3600'000 * kMs, int64_t{0}}) {
    const auto until = std::chrono::steady_clock::now() + kLong;
    do {
      const int64_t stamp = std::max<int64_t>(monotonicNow_ns() + off_ns, (sequence_ + 1) * kMs);
      shoot(stamp, stamp);
      unbelievable += off_ns != 0;
      ASSERT_TRUE(await(*source, arrived));
    } while (!source->ready(milliseconds(0)) && std::chrono::steady_clock::now() < until);
    ASSERT_TRUE(source->ready(milliseconds(0)));
    const auto next = source->next();
    ASSERT_TRUE(next && *next);
    EXPECT_GT((*next)->stamp_ns, last);
    last = (*next)->stamp_ns;
  }
  EXPECT_EQ(source->health()->colour.clock_jumps, unbelievable);
  EXPECT_EQ(source->health()->depth.clock_jumps, unbelievable);
}

TEST_F(PairedSourceTest, ADamagedPictureIsAnErrorOfItsFrame) {
  auto source = open();
  const int64_t now = monotonicNow_ns();
  video_.deliver(kDepth, {{1, 2, 3}, 1, now});
  video_.deliver(kColour, {colourBytes(), 1, now});
  ASSERT_TRUE(source->ready(kLong));
  const auto next = source->next();
  ASSERT_FALSE(next);
  EXPECT_EQ(next.error().code, ErrorCode::kBadData);
  EXPECT_EQ(source->health()->not_decoded, 1u);
  shoot();
  ASSERT_TRUE(source->ready(kLong));
  EXPECT_TRUE(source->next());
}

TEST_F(PairedSourceTest, ARecordingReplaysIdentically) {
  TemporaryFolder folder;
  auto source = open();
  std::vector<Frame> taken;
  // Sees what is recorded.
  class Witness final : public FrameSource {
   public:
    Witness(FrameSource& source, std::vector<Frame>& seen, std::function<void()> shoot)
        : source_(source), seen_(seen), shoot_(std::move(shoot)) {}
    Result<std::optional<Frame>> next() override {
      shoot_();
      auto next = source_.next();
      if (next && *next) seen_.push_back(**next);
      return next;
    }
    size_t size() const override { return 0; }
    std::string description() const override { return ""; }
    bool live() const override { return true; }

   private:
    FrameSource& source_;
    std::vector<Frame>& seen_;
    std::function<void()> shoot_;
  } witness(*source, taken, [this] { shoot(); });
  const std::string place = folder / "recorded";
  const auto done = record(
      witness, place, 6, [] { return false; }, [](const std::string&) {});
  ASSERT_TRUE(done) << done.error().text;
  ASSERT_EQ(taken.size(), 6u);
  auto replay = openSource("tum:" + place);
  ASSERT_TRUE(replay) << replay.error().text;
  for (const Frame& frame : taken) {
    const auto next = (*replay)->next();
    ASSERT_TRUE(next && *next);
    EXPECT_EQ((*next)->stamp_ns, frame.stamp_ns);
    EXPECT_EQ((*next)->camera, frame.camera);
    EXPECT_EQ((*next)->colour, frame.colour);
    EXPECT_EQ((*next)->depth, frame.depth);
  }
  EXPECT_FALSE(*(*replay)->next());
  EXPECT_EQ(record(
                witness, place, 1, [] { return false; }, [](const std::string&) {})
                .error()
                .code,
            ErrorCode::kWrongUse)
      << "a recording is not written over";
}

TEST_F(PairedSourceTest, PreviewShowsBothSideBySide) {
  TemporaryFolder folder;
  auto source = open();
  std::jthread shooting([this](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      shoot();
      std::this_thread::sleep_for(milliseconds(10));
    }
  });
  std::string said;
  const auto done = preview(*source, folder / "p.png", [&](const std::string& line) { said += line; });
  ASSERT_TRUE(done) << done.error().text;
  const auto picture = readColour(folder / "p.png");
  ASSERT_TRUE(picture);
  ASSERT_EQ(picture->width(), 640);
  ASSERT_EQ(picture->height(), 240);
  for (int x = 0; x < 320; ++x) ASSERT_EQ(picture->at(x, 100), frame_.colour.at(x, 100));
  EXPECT_NE(picture->at(480, 120), Rgb{});
  EXPECT_THAT(said, HasSubstr("320x240"));
}

TEST_F(PairedSourceTest, WrongNamesAreRefused) {
  const auto refusal = [&](const std::string& scheme, const std::string& place) {
    auto source = openCamera(scheme, place, config_, nullptr, video_);
    EXPECT_FALSE(source) << place;
    return source ? Error{} : source.error();
  };
  for (const char* place : {"/dev/video0", "", ",", "/dev/video0,", ",/dev/video0", "/dev/video0,/dev/video0"})
    EXPECT_EQ(refusal("v4l2", place).code, ErrorCode::kWrongUse) << place;
  EXPECT_EQ(refusal("v4l2", "/dev/video2,/dev/video9").code, ErrorCode::kUnreachable);
  EXPECT_EQ(refusal("pair", "v4l2:/dev/video2,/dev/video0").code, ErrorCode::kWrongUse);
  EXPECT_EQ(refusal("pair", "tum:/a,v4l2:/dev/video0").code, ErrorCode::kWrongUse);
  config_.rig.colour.pinhole.fx = 0;
  EXPECT_THAT(refusal("v4l2", "/dev/video2,/dev/video0").text, HasSubstr("camera.profile"));
  EXPECT_EQ(video_.openDescriptors(), 0);
}

}  // namespace
}  // namespace comap
