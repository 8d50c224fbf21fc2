#include "edge_agent/capture/camera_config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace comap {
namespace {

using testing::HasSubstr;

struct Read {
  CameraConfig config;
  std::string problem;
};

Read read(const std::string& text) {
  Read made;
  auto reader = ConfigReader::fromText(text, "robot.yaml");
  EXPECT_TRUE(reader) << reader.error().text;
  readCameraConfig(reader->section("camera"), made.config);
  if (auto finished = reader->finish(); !finished) made.problem = finished.error().text;
  return made;
}

TEST(CameraConfig, WhatIsPrintedIsReadBack) {
  const std::string defaults = printCameraConfig({});
  const Read same = read(defaults);
  EXPECT_EQ(same.problem, "");
  EXPECT_EQ(printCameraConfig(same.config), defaults);

  CameraConfig config;
  config.profile = "realsense-d435";
  config.rig = config.builtIn()->rig;
  config.rig.colour.k1 = 0.1;
  config.rig.depth.p2 = -0.003;
  config.rig.depth_units_per_m = 5000;
  config.shrink = 2;
  config.colour_controls.exposure_us = 8000;
  config.rig.T_colour_depth =
      Pose(Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitX())), {0.015, -0.001, 0.002});
  const Read back = read(printCameraConfig(config));
  EXPECT_EQ(back.problem, "");
  EXPECT_EQ(back.config.rig.colour, config.rig.colour);
  EXPECT_EQ(back.config.rig.depth, config.rig.depth);
  EXPECT_EQ(back.config.shrink, 2);
  EXPECT_EQ(back.config.colour_controls.exposure_us, 8000);
  EXPECT_NEAR((back.config.rig.T_colour_depth.inverse() * config.rig.T_colour_depth).log().norm(), 0, 1e-9);
}

TEST(CameraConfig, AProfileHoldsWhereNothingElseIsSaid) {
  const Read made =
      read("camera:\n  profile: kinect-v1\n  colour:\n    fx: 530.5\n  depth_in_colour:\n    y_m: 0.001\n");
  EXPECT_EQ(made.problem, "");
  EXPECT_EQ(made.config.rig.colour.pinhole.fx, 530.5);
  EXPECT_EQ(made.config.rig.colour.pinhole.fy, 525);
  EXPECT_EQ(made.config.rig.depth.pinhole.fx, 585);
  EXPECT_EQ(made.config.rig.T_colour_depth.translation(), Eigen::Vector3d(-0.025, 0.001, 0));
}

TEST(CameraConfig, AProfileFollowsTheSize) {
  const Read half = read("camera:\n  profile: kinect-v1\n  colour:\n    width: 320\n    height: 240\n");
  EXPECT_EQ(half.problem, "");
  EXPECT_EQ(half.config.rig.colour.pinhole.fx, 262.5);
  const Read other = read("camera:\n  profile: kinect-v1\n  colour:\n    width: 1280\n    height: 720\n");
  EXPECT_THAT(other.problem, HasSubstr("other proportions"));
}

TEST(CameraConfig, MistakesAreNamed) {
  EXPECT_THAT(read("camera:\n  colour:\n    fx: 525\n").problem, HasSubstr("fy"));
  EXPECT_THAT(read("camera:\n  colour:\n    fx: 0.001\n    fy: 525\n").problem, HasSubstr("at least 64 pixels"));
  EXPECT_THAT(read("camera:\n  profile: webcam\n").problem, HasSubstr("robot.yaml:2: camera.profile"));
  EXPECT_THAT(read("camera:\n  shrink: 3\n").problem, HasSubstr("expected 1, 2 or 4"));
  EXPECT_THAT(read("camera:\n  colour:\n    format: H264\n").problem, HasSubstr("camera.colour.format"));
  EXPECT_THAT(read("camera:\n  depth_units_per_m: 0\n").problem, HasSubstr("depth_units_per_m"));
  EXPECT_THAT(read("camera:\n  depth:\n    focal: 3\n").problem, HasSubstr("unknown key 'camera.depth.focal'"));
}

}  // namespace
}  // namespace comap
