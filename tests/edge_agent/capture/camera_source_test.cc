// What names of live cameras lead to, with the libraries of this build and no camera.
#include "edge_agent/capture/camera_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "edge_agent/capture/libcamera.h"
#include "edge_agent/capture/openni2.h"
#include "tests/edge_agent/capture/fake_video.h"

namespace comap {
namespace {

using testing::HasSubstr;

CameraConfig kinect() {
  CameraConfig made;
  made.profile = "kinect-v1";
  made.rig = made.builtIn()->rig;
  return made;
}

Error refusal(const std::string& scheme, const std::string& place) {
  FakeVideo video;
  auto source = openCamera(scheme, place, kinect(), nullptr, video);
  EXPECT_FALSE(source) << place;
  return source ? Error{} : source.error();
}

TEST(CameraSource, ALibraryThatIsNotThereIsSaid) {
  std::string all;
  for (const std::string& line : cameraSchemes()) all += line + "\n";
  EXPECT_THAT(all, HasSubstr("libcamera:ID"));
  EXPECT_THAT(all, HasSubstr("openni2:URI"));
  EXPECT_EQ(all.find("libcamera-dev was missing") == std::string::npos, hasLibcamera());
  EXPECT_EQ(all.find("libopenni2-dev was missing") == std::string::npos, hasOpenNi2());
}

TEST(CameraSource, LibcameraIsTheColourOfAPair) {
  const Error unknown = refusal("pair", "libcamera:no such camera,v4l2:/dev/video0");
  EXPECT_EQ(unknown.code, ErrorCode::kUnreachable);
  EXPECT_THAT(unknown.text, hasLibcamera() ? HasSubstr("'no such camera' is not there") : HasSubstr("was missing"));
  const Error depth = refusal("pair", "libcamera:a,libcamera:b");
  EXPECT_NE(depth.code, ErrorCode::kProblem);
}

TEST(CameraSource, StreamsOfOtherSchemesAreRefused) {
  EXPECT_THAT(refusal("pair", "tum:/a,v4l2:/dev/video0").text, HasSubstr("scheme 'tum' gives no single stream"));
  EXPECT_EQ(refusal("pair", "/dev/video2,/dev/video0").code, ErrorCode::kWrongUse);
}

}  // namespace
}  // namespace comap
