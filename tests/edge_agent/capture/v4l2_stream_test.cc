#include "edge_agent/capture/v4l2_stream.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "edge_agent/capture/camera_source.h"
#include "edge_agent/capture/picture_convert.h"
#include "tests/edge_agent/capture/fake_video.h"

namespace comap {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

constexpr char kPath[] = "/dev/video0";
constexpr int64_t kSecond_ns = 1'000'000'000;

FakeDevice webcam() {
  FakeDevice device;
  device.modes = {{V4L2_PIX_FMT_MJPEG, 64, 48, 30},
                  {V4L2_PIX_FMT_YUYV, 64, 48, 30},
                  {V4L2_PIX_FMT_YUYV, 128, 96, 5},
                  {V4L2_PIX_FMT_MJPEG, 128, 96, 30},
                  {v4l2_fourcc('H', '2', '6', '4'), 64, 48, 30}};
  return device;
}

VideoWish small() { return {PictureKind::kColour, "auto", 64, 48, 30}; }

std::unique_ptr<PictureStream> open(FakeVideo& video, const VideoWish& wish = small(),
                                    const VideoControls& controls = {}) {
  auto stream = openV4l2(video, kPath, wish, controls);
  EXPECT_TRUE(stream) << stream.error().text;
  return stream ? std::move(*stream) : nullptr;
}

Error refusal(FakeVideo& video, const VideoWish& wish = small(), const VideoControls& controls = {}) {
  auto stream = openV4l2(video, kPath, wish, controls);
  EXPECT_FALSE(stream);
  EXPECT_EQ(video.openDescriptors(), 0) << "a refused device is closed";
  EXPECT_EQ(video.mappings(), 0);
  return stream ? Error{} : stream.error();
}

std::vector<uint8_t> grey(size_t bytes, uint8_t value = 100) { return std::vector<uint8_t>(bytes, value); }

TEST(V4l2Stream, DeliversWhatTheDeviceTook) {
  FakeVideo video;
  video.plug(kPath, webcam());
  {
    auto stream = open(video);
    EXPECT_THAT(stream->description(), HasSubstr("YUYV 64x48"));
    EXPECT_TRUE(video.look(kPath).streaming);
    for (uint32_t i = 0; i < 10; ++i) {  // more than there are buffers: they go back
      video.deliver(kPath, {grey(64 * 48 * 2, static_cast<uint8_t>(i)), i, kSecond_ns + i * 1000});
      const auto taken = stream->take(milliseconds(1000));
      ASSERT_TRUE(taken && *taken);
      EXPECT_EQ((*taken)->bytes, grey(64 * 48 * 2, static_cast<uint8_t>(i)));
      EXPECT_EQ((*taken)->sequence, i);
      EXPECT_EQ((*taken)->stamp_ns, kSecond_ns + i * 1000);
      EXPECT_EQ((*taken)->stride_bytes, 128);
    }
    const auto none = stream->take(milliseconds(0));
    ASSERT_TRUE(none);
    EXPECT_FALSE(*none);
  }
  EXPECT_FALSE(video.look(kPath).streaming);
  EXPECT_EQ(video.openDescriptors(), 0);
  EXPECT_EQ(video.mappings(), 0);
}

// As boards have it whose camera is part of the processor: Raspberry Pi, Rockchip.
TEST(V4l2Stream, ADeviceWithTheMultiPlaneInterfaceAlone) {
  FakeVideo video;
  FakeDevice device = webcam();
  device.capabilities = V4L2_CAP_VIDEO_CAPTURE_MPLANE | V4L2_CAP_STREAMING;
  device.multi_plane_stride = 192;
  device.data_offset = 64;
  video.plug(kPath, device);
  {
    auto stream = open(video);
    EXPECT_TRUE(video.look(kPath).streaming);
    for (uint32_t i = 0; i < 10; ++i) {
      auto bytes = grey(64 + 192 * 48, 7);
      std::fill(bytes.begin() + 64, bytes.end(), static_cast<uint8_t>(100 + i));
      video.deliver(kPath, {bytes, i, kSecond_ns + i * 1000});
      const auto taken = stream->take(milliseconds(1000));
      ASSERT_TRUE(taken && *taken);
      EXPECT_EQ((*taken)->bytes, grey(192 * 48, static_cast<uint8_t>(100 + i)));
      EXPECT_EQ((*taken)->stride_bytes, 192);
      EXPECT_EQ((*taken)->sequence, i);
    }
    video.deliver(kPath, {grey(16), 10, kSecond_ns, V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC, 1 << 20});
    EXPECT_EQ(stream->take(milliseconds(1000)).error().code, ErrorCode::kBadData) << "more than the buffer holds";
    video.deliver(kPath, {grey(16), 11, kSecond_ns});
    EXPECT_EQ(stream->take(milliseconds(1000)).error().code, ErrorCode::kBadData) << "ends before it begins";
    video.deliver(kPath, {grey(64 + 8, 9), 12, kSecond_ns});
    const auto taken = stream->take(milliseconds(1000));
    ASSERT_TRUE(taken && *taken) << "the buffers went back";
    EXPECT_EQ((*taken)->bytes, grey(8, 9));
  }
  EXPECT_FALSE(video.look(kPath).streaming);
  EXPECT_EQ(video.openDescriptors(), 0);
  EXPECT_EQ(video.mappings(), 0);
}

TEST(V4l2Stream, PrefersPicturesThatNeedNoDecodingIfTheyComeInTime) {
  FakeVideo video;
  video.plug(kPath, webcam());
  EXPECT_THAT(open(video)->description(), HasSubstr("YUYV 64x48"));
  EXPECT_THAT(open(video, {PictureKind::kColour, "auto", 128, 96, 30})->description(), HasSubstr("MJPG 128x96"));
  EXPECT_THAT(open(video, {PictureKind::kColour, "auto", 128, 96, 5})->description(), HasSubstr("YUYV 128x96"));
  EXPECT_THAT(open(video, {PictureKind::kColour, "MJPG", 64, 48, 30})->description(), HasSubstr("MJPG 64x48"));
}

TEST(V4l2Stream, RefusalsSayWhatIsOffered) {
  FakeVideo video;
  video.plug(kPath, webcam());
  const Error size = refusal(video, {PictureKind::kColour, "auto", 640, 480, 30});
  EXPECT_EQ(size.code, ErrorCode::kWrongUse);
  EXPECT_THAT(size.text, HasSubstr("no colour pictures of 640x480"));
  EXPECT_THAT(size.text, HasSubstr("YUYV 128x96 5 fps"));
  EXPECT_THAT(refusal(video, {PictureKind::kDepth, "auto", 64, 48, 30}).text, HasSubstr("no depth pictures"));
  EXPECT_THAT(refusal(video, {PictureKind::kColour, "NV12", 64, 48, 30}).text, HasSubstr("as NV12"));
}

TEST(V4l2Stream, RefusesDevicesThatDoNotFit) {
  FakeVideo video;
  EXPECT_EQ(refusal(video).code, ErrorCode::kUnreachable);
  FakeDevice device = webcam();
  device.capabilities = V4L2_CAP_VIDEO_CAPTURE_MPLANE | V4L2_CAP_STREAMING;
  device.planes = 2;
  video.plug(kPath, device);
  EXPECT_THAT(refusal(video).text, HasSubstr("YUYV 64x48 30 fps in 2 planes, expected 1"));
  device = webcam();
  device.capabilities = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
  video.plug(kPath, device);
  EXPECT_THAT(refusal(video).text, HasSubstr("gives no pictures"));
  device = webcam();
  device.capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_READWRITE;
  video.plug(kPath, device);
  EXPECT_THAT(refusal(video).text, HasSubstr("does not stream"));
  device = webcam();
  device.busy = true;
  video.plug(kPath, device);
  EXPECT_THAT(refusal(video).text, HasSubstr("another program"));
  device = webcam();
  device.forced_width = 32;
  video.plug(kPath, device);
  EXPECT_THAT(refusal(video).text, HasSubstr("gives YUYV 32x48"));
}

TEST(V4l2Stream, DamageIsToldAndPassedOver) {
  FakeVideo video;
  video.plug(kPath, webcam());
  auto stream = open(video);
  video.deliver(kPath, {grey(64 * 48 * 2), 0, kSecond_ns, V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_ERROR});
  auto taken = stream->take(milliseconds(1000));
  ASSERT_FALSE(taken);
  EXPECT_EQ(taken.error().code, ErrorCode::kBadData);
  video.failNext(kPath, EIO);
  taken = stream->take(milliseconds(1000));
  ASSERT_FALSE(taken);
  EXPECT_EQ(taken.error().code, ErrorCode::kBadData);
  video.failNext(kPath, EAGAIN);
  taken = stream->take(milliseconds(1000));
  ASSERT_TRUE(taken);
  EXPECT_FALSE(*taken);
  video.deliver(kPath, {grey(16), 1, kSecond_ns, V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC, 1 << 20});
  taken = stream->take(milliseconds(1000));
  ASSERT_FALSE(taken) << "more bytes than the buffer has";
  EXPECT_EQ(taken.error().code, ErrorCode::kBadData);
  video.deliver(kPath, {grey(100), 2, kSecond_ns});
  taken = stream->take(milliseconds(1000));
  ASSERT_TRUE(taken && *taken) << "a short one comes, and its decoding fails";
  EXPECT_EQ(toColour(**taken).error().code, ErrorCode::kBadData);
  for (uint32_t i = 0; i < 8; ++i) {  // no buffer was lost by all that
    video.deliver(kPath, {grey(64 * 48 * 2), 3 + i, kSecond_ns + 1000 * i});
    taken = stream->take(milliseconds(1000));
    ASSERT_TRUE(taken && *taken);
  }
}

TEST(V4l2Stream, ADeviceThatIsGoneIsUnreachable) {
  for (const bool by_poll : {true, false}) {
    FakeVideo video;
    video.plug(kPath, webcam());
    auto stream = open(video);
    if (by_poll) {
      video.unplug(kPath);
    } else {
      video.failNext(kPath, ENODEV);
    }
    const auto taken = stream->take(milliseconds(1000));
    ASSERT_FALSE(taken);
    EXPECT_EQ(taken.error().code, ErrorCode::kUnreachable);
    EXPECT_THAT(taken.error().text, HasSubstr(kPath));
  }
}

TEST(V4l2Stream, AChangedSourceHasToBeOpenedAnew) {
  FakeVideo video;
  video.plug(kPath, webcam());
  auto stream = open(video);
  video.changeSource(kPath);
  const auto taken = stream->take(milliseconds(1000));
  ASSERT_FALSE(taken);
  EXPECT_EQ(taken.error().code, ErrorCode::kUnreachable);
  EXPECT_THAT(taken.error().text, HasSubstr("changed its format"));
}

TEST(V4l2Stream, StampsOfAnotherClockAreNotTaken) {
  FakeVideo video;
  video.plug(kPath, webcam());
  auto stream = open(video);
  video.deliver(kPath, {grey(64 * 48 * 2), 0, kSecond_ns, V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN});
  const auto taken = stream->take(milliseconds(1000));
  ASSERT_TRUE(taken && *taken);
  EXPECT_EQ((*taken)->stamp_ns, 0);
}

v4l2_queryctrl range(uint32_t id, int low, int high) {
  v4l2_queryctrl control{};
  control.id = id;
  control.minimum = low;
  control.maximum = high;
  return control;
}

TEST(V4l2Stream, SetsControls) {
  FakeVideo video;
  FakeDevice device = webcam();
  for (const v4l2_queryctrl& control :
       {range(V4L2_CID_EXPOSURE_AUTO, 0, 3), range(V4L2_CID_EXPOSURE_ABSOLUTE, 1, 5000), range(V4L2_CID_GAIN, 0, 64)})
    device.controls[control.id] = control;
  video.plug(kPath, device);
  VideoControls controls;
  controls.exposure_us = 12'345;
  controls.gain = 7;
  auto stream = open(video, small(), controls);
  auto set = video.look(kPath).controls;
  EXPECT_EQ(set[V4L2_CID_EXPOSURE_AUTO].default_value, V4L2_EXPOSURE_MANUAL);
  EXPECT_EQ(set[V4L2_CID_EXPOSURE_ABSOLUTE].default_value, 123);
  EXPECT_EQ(set[V4L2_CID_GAIN].default_value, 7);
  stream.reset();
  controls.exposure_us = 0;
  stream = open(video, small(), controls);
  EXPECT_EQ(video.look(kPath).controls[V4L2_CID_EXPOSURE_AUTO].default_value, V4L2_EXPOSURE_APERTURE_PRIORITY);
  stream.reset();
  controls.gain = 65;
  EXPECT_THAT(refusal(video, small(), controls).text, HasSubstr("gain 65 is outside its range 0..64"));
  video.plug(kPath, webcam());
  EXPECT_THAT(refusal(video, small(), controls).text, HasSubstr("has no control for"));
}

TEST(V4l2Stream, IsListed) {
  FakeVideo video;
  video.plug(kPath, webcam());
  FakeDevice metadata;
  metadata.card = "bad\x1b[31mname";
  metadata.capabilities = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
  video.plug("/dev/video1", metadata);
  std::string all;
  for (const std::string& line : v4l2Found(video)) all += line + "\n";
  EXPECT_THAT(all, HasSubstr("/dev/video0: Fake camera (fake-1)"));
  EXPECT_THAT(all, HasSubstr("YUYV 128x96 5 fps"));
  EXPECT_THAT(all, HasSubstr("not understood here: H264"));
  EXPECT_THAT(all, HasSubstr("/dev/video1 (bad?[31mname): gives no pictures"));
  EXPECT_EQ(video.openDescriptors(), 0);
}

}  // namespace
}  // namespace comap
