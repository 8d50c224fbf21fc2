// OpenNI2 with a driver of our own (openni2_driver.cc): live, recorded as .oni, replayed, tracked.
#include <OpenNI.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <thread>

#include "edge_agent/capture/camera_source.h"
#include "edge_agent/capture/source_uri.h"
#include "edge_agent/capture/tum_writer.h"
#include "edge_agent/odometry/visual_odometry.h"
#include "tests/files/temporary_folder.h"
#include "tests/scenes/scene.h"

namespace comap {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;

constexpr int kFrames = 30;
constexpr milliseconds kLong{20'000};

Pose walk(int i) {
  return Pose(Eigen::Quaterniond(Eigen::AngleAxisd(0.008 * i, Eigen::Vector3d::UnitY())),
              {0.006 * i, 0.02 * std::sin(0.2 * i), 0.004 * i});
}

// The scene as a folder, which the driver shows; made before OpenNI2 starts, as it starts once.
class OpenNi2Test : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    auto writer = TumWriter::create(scene());
    ASSERT_TRUE(writer);
    // With the pixel centre where a field of view puts it.
    const CameraModel camera{262.5, 262.5, 159.5, 119.5, 320, 240};
    const Scene room = Scene::room();
    for (int i = 0; i < kFrames; ++i) {
      Frame frame = room.render(camera, walk(i), 1'000'000'000 + i * 33'333'000);
      for (size_t p = 0; p < frame.depth.size(); ++p)
        frame.depth.data()[p] = static_cast<uint16_t>(frame.depth.data()[p] / 5 * 5);
      ASSERT_TRUE(writer->add(frame));
    }
    setenv("COMAP_TEST_SCENE", scene().c_str(), 1);
    setenv("COMAP_TEST_PERIOD_MS", "12", 1);
    ASSERT_EQ(openni::OpenNI::initialize(), openni::STATUS_OK) << openni::OpenNI::getExtendedError();
  }
  static void TearDownTestSuite() { delete folder_; }
  void SetUp() override {
    unsetenv("COMAP_TEST_REPEAT");
    setenv("COMAP_TEST_REGISTERS", "1", 1);
  }

  static std::string scene() { return *folder_ / "scene"; }

  static CameraConfig config() {
    CameraConfig made;  // focal lengths are the device's to tell
    made.rig.colour.pinhole = made.rig.depth.pinhole = {0, 0, 0, 0, 320, 240};
    return made;
  }

  static std::vector<Frame> all(FrameSource& source) {
    std::vector<Frame> frames;
    while (true) {
      auto next = source.next();
      EXPECT_TRUE(next) << next.error().text;
      if (!next || !*next) return frames;
      frames.push_back(std::move(**next));
    }
  }

  // As OpenNI2's own tools record: all that the device shows until nothing comes any more.
  static void recordOni(const std::string& path) {
    openni::Device device;
    ASSERT_EQ(device.open("comap-test/1"), openni::STATUS_OK) << openni::OpenNI::getExtendedError();
    openni::VideoStream depth, colour;
    ASSERT_EQ(depth.create(device, openni::SENSOR_DEPTH), openni::STATUS_OK);
    ASSERT_EQ(colour.create(device, openni::SENSOR_COLOR), openni::STATUS_OK);
    depth.setMirroringEnabled(false);
    colour.setMirroringEnabled(false);
    openni::Recorder recorder;
    ASSERT_EQ(recorder.create(path.c_str()), openni::STATUS_OK);
    ASSERT_EQ(recorder.attach(depth), openni::STATUS_OK);
    ASSERT_EQ(recorder.attach(colour), openni::STATUS_OK);
    ASSERT_EQ(recorder.start(), openni::STATUS_OK);
    ASSERT_EQ(depth.start(), openni::STATUS_OK);
    ASSERT_EQ(colour.start(), openni::STATUS_OK);
    openni::VideoStream* streams[] = {&depth, &colour};
    int which = 0;
    while (openni::OpenNI::waitForAnyStream(streams, 2, &which, 3000) == openni::STATUS_OK) {
      openni::VideoFrameRef frame;
      streams[which]->readFrame(&frame);
    }
    recorder.stop();
    recorder.destroy();
    depth.destroy();
    colour.destroy();
  }

  // Mean and worst distance of the tracked camera from where it stood.
  static double ate(const std::vector<Frame>& frames) {
    VisualOdometry odometry(OdometryOptions{});
    double sum = 0;
    for (size_t i = 0; i < frames.size(); ++i) {
      const TrackedFrame tracked = odometry.track(frames[i]);
      if (tracked.first) {
        odometry.makeKeyframe(tracked);
      } else {
        odometry.addToKeyframe(tracked);
      }
      sum += (tracked.T_odom_cam.translation() - (walk(0).inverse() * walk(static_cast<int>(i))).translation())
                 .squaredNorm();
    }
    return std::sqrt(sum / static_cast<double>(frames.size()));
  }

  static inline TemporaryFolder* folder_ = nullptr;
};

TEST_F(OpenNi2Test, IsListed) {
  std::string all;
  for (const std::string& line : camerasFound()) all += line + "\n";
  EXPECT_THAT(all, HasSubstr("openni2 comap-test/1: CoMap Scene"));
  EXPECT_THAT(all, HasSubstr("depth 320x240 30 fps"));
  EXPECT_THAT(all, HasSubstr("registers depth into colour"));
}

TEST_F(OpenNi2Test, ARecordingIsTheSceneAndTracksAsItsTumFolder) {
  const std::string path = *folder_ / "walk.oni";
  recordOni(path);
  CameraConfig registered = config();
  registered.registration = "device";
  auto oni = openSource("openni2:" + path, registered);
  ASSERT_TRUE(oni) << oni.error().text;
  EXPECT_FALSE((*oni)->live());
  EXPECT_EQ((*oni)->size(), static_cast<size_t>(kFrames));
  const std::vector<Frame> recorded = all(**oni);
  auto tum = openSource(scene());
  ASSERT_TRUE(tum);
  const std::vector<Frame> truth = all(**tum);
  ASSERT_EQ(truth.size(), static_cast<size_t>(kFrames));
  ASSERT_EQ(recorded.size(), truth.size());
  for (size_t i = 0; i < truth.size(); ++i) {
    EXPECT_EQ(recorded[i].stamp_ns - recorded[0].stamp_ns, truth[i].stamp_ns - truth[0].stamp_ns) << i;
    EXPECT_EQ(recorded[i].colour, truth[i].colour) << i;
    // OpenNI2's own compression may be 1 mm wrong in the last few pixels of a picture.
    const size_t exact = truth[i].depth.size() - 8;
    EXPECT_TRUE(std::equal(truth[i].depth.data(), truth[i].depth.data() + exact, recorded[i].depth.data())) << i;
    for (size_t p = exact; p < truth[i].depth.size(); ++p)
      EXPECT_NEAR(recorded[i].depth.data()[p], truth[i].depth.data()[p], 5) << i;
    EXPECT_NEAR(recorded[i].camera.fx, truth[i].camera.fx, 1e-4) << "told as a field of view, in single precision";
    EXPECT_EQ(recorded[i].camera.cx, truth[i].camera.cx);
  }
  const double ate_tum_m = ate(truth), ate_oni_m = ate(recorded);
  EXPECT_LT(ate_tum_m, 0.004);
  EXPECT_NEAR(ate_oni_m, ate_tum_m, 1e-6);
  RecordProperty("ate_tum_mm", std::to_string(ate_tum_m * 1000));
  RecordProperty("ate_oni_mm", std::to_string(ate_oni_m * 1000));
  std::printf("ATE: TUM folder %.6f mm, .oni %.6f mm\n", ate_tum_m * 1000, ate_oni_m * 1000);
}

TEST_F(OpenNi2Test, ATruncatedRecordingIsAnErrorOrShorter) {
  const std::string path = *folder_ / "cut.oni";
  recordOni(path);
  std::filesystem::resize_file(path, std::filesystem::file_size(path) / 5);
  CameraConfig registered = config();
  registered.registration = "device";
  auto oni = openSource("openni2:" + path, registered);
  if (!oni) {
    EXPECT_NE(oni.error().code, ErrorCode::kWrongUse);
    return;
  }
  size_t frames = 0;
  for (int i = 0; i < 2 * kFrames; ++i) {
    auto next = (*oni)->next();
    if (next && !*next) break;
    frames += next.operator bool();
  }
  EXPECT_LT(frames, static_cast<size_t>(kFrames));
}

TEST_F(OpenNi2Test, StreamsLiveUnmirroredAndRegisteredByTheDevice) {
  setenv("COMAP_TEST_REPEAT", "1", 1);
  auto source = openSource("openni2:comap-test/1", config());
  ASSERT_TRUE(source) << source.error().text;
  EXPECT_TRUE((*source)->live());
  const auto truth = [] {
    auto tum = openSource(scene());
    return all(**tum);
  }();
  int64_t last = 0;
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE((*source)->ready(kLong));
    const auto next = (*source)->next();
    ASSERT_TRUE(next && *next) << (next ? "" : next.error().text);
    EXPECT_GT((*next)->stamp_ns, last);
    last = (*next)->stamp_ns;
    EXPECT_TRUE(std::any_of(truth.begin(), truth.end(), [&](const Frame& frame) {
      return frame.colour == (*next)->colour && frame.depth == (*next)->depth;
    })) << "both pictures of one moment, not mirrored";
  }
}

TEST_F(OpenNi2Test, IsRegisteredHereIfAskedFor) {
  setenv("COMAP_TEST_REPEAT", "1", 1);
  CameraConfig software = config();
  software.registration = "software";
  software.rig.T_colour_depth = Pose(Eigen::Quaterniond::Identity(), {0.05, 0, 0});
  auto source = openSource("openni2:", software);
  ASSERT_TRUE(source) << source.error().text;
  ASSERT_TRUE((*source)->ready(kLong));
  const auto next = (*source)->next();
  ASSERT_TRUE(next && *next);
  for (int y = 0; y < 240; ++y) EXPECT_EQ((*next)->depth.at(0, y), 0) << "depth has moved to the right";
}

TEST_F(OpenNi2Test, ADeviceThatDoesNotRegisterSaysSo) {
  unsetenv("COMAP_TEST_REGISTERS");
  CameraConfig device = config();
  device.registration = "device";
  const auto refused = openSource("openni2:comap-test/1", device);
  EXPECT_EQ(refused.error().code, ErrorCode::kWrongUse);
  EXPECT_THAT(refused.error().text, HasSubstr("does not register depth into colour"));
}

TEST_F(OpenNi2Test, IsWaitedForWhenUnplugged) {
  setenv("COMAP_TEST_REPEAT", "1", 1);
  auto source = openSource("openni2:comap-test/1", config());
  ASSERT_TRUE(source) << source.error().text;
  ASSERT_TRUE((*source)->ready(kLong));
  ASSERT_TRUE((*source)->next());
  const auto await = [&](auto condition) {
    const auto until = std::chrono::steady_clock::now() + kLong;
    while (std::chrono::steady_clock::now() < until) {
      if ((*source)->ready(milliseconds(5))) (void)(*source)->next();
      const CaptureHealth health = *(*source)->health();
      if (condition(health.colour) && condition(health.depth)) return true;
    }
    return false;
  };
  folder_->write("scene/unplugged", "");
  EXPECT_TRUE(await([](const StreamHealth& stream) { return stream.state == StreamState::kGone; }));
  std::filesystem::remove(*folder_ / "scene/unplugged");
  EXPECT_TRUE(await(
      [](const StreamHealth& stream) { return stream.state == StreamState::kStreaming && stream.reopened == 1; }));
  ASSERT_TRUE((*source)->ready(kLong));
  EXPECT_TRUE((*source)->next());
}

TEST_F(OpenNi2Test, TheAgentTracksLiveUntilItIsStopped) {
  setenv("COMAP_TEST_REPEAT", "1", 1);
  folder_->write("robot.yaml", "camera:\n  colour: {width: 320, height: 240}\n  depth: {width: 320, height: 240}\n");
  const std::string command =
      std::string("LD_LIBRARY_PATH=" COMAP_PRIVATE_OPENNI2 " timeout --preserve-status -s INT 10 " COMAP_BIN_DIR
                  "/edge_agent --config ") +
      (*folder_ / "robot.yaml") + " --source openni2: --robot a --offline --outbox " + (*folder_ / "outbox") +
      " --report " + (*folder_ / "report.json") + " 2>" + (*folder_ / "log");
  EXPECT_EQ(std::system(command.c_str()), 0) << folder_->read("log");
  EXPECT_THAT(folder_->read("log"), HasSubstr("camera: colour streaming, depth streaming"));
  EXPECT_THAT(folder_->read("log"), HasSubstr("keyframes wait in"));
  const std::string report = folder_->read("report.json");
  EXPECT_THAT(report, HasSubstr("\"camera\":{\"colour\":{"));
  EXPECT_THAT(report, testing::Not(HasSubstr("\"frames\":0,")));
}

TEST_F(OpenNi2Test, WhatIsNotThereIsSaid) {
  EXPECT_EQ(openSource("openni2:nothing/9", config()).error().code, ErrorCode::kUnreachable);
  EXPECT_EQ(openSource("openni2:/no/such/file.oni", config()).error().code, ErrorCode::kUnreachable);
  folder_->write("text.oni", "this is no recording");
  EXPECT_NE(openSource("openni2:" + (*folder_ / "text.oni"), config()).error().code, ErrorCode::kWrongUse);
  CameraConfig large = config();
  large.rig.colour.pinhole.width = 1280;
  const auto refused = openSource("openni2:comap-test/1", large);
  EXPECT_EQ(refused.error().code, ErrorCode::kWrongUse);
  EXPECT_THAT(refused.error().text, HasSubstr("RGB3 320x240 30 fps"));
}

}  // namespace
}  // namespace comap
