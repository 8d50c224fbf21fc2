#include "edge_agent/agent_config.h"

#include <gtest/gtest.h>

#include "tests/files/temporary_folder.h"

namespace comap {
namespace {

AgentConfig read(const std::string& text) {
  TemporaryFolder folder;
  folder.write("robot.yaml", text);
  auto config = readAgentConfig(folder / "robot.yaml");
  EXPECT_TRUE(config) << config.error().text;
  return config ? *config : AgentConfig();
}

TEST(AgentConfig, ACameraProfileBringsItsDepthNoise) {
  const AgentConfig config = read("camera:\n  profile: realsense-d435\n");
  EXPECT_FLOAT_EQ(config.odometry.alignment.noise.factor_per_m, 0.0042f);
  EXPECT_FLOAT_EQ(config.recovery.relocaliser.noise.factor_per_m, 0.0042f);
  EXPECT_FLOAT_EQ(config.localizer.registration.noise.factor_per_m, 0.0042f);
}

TEST(AgentConfig, WhatIsSaidOfDepthNoiseGoesBeforeTheProfile) {
  const AgentConfig config = read("odometry:\n  depth_noise_factor_per_m: 0.003\ncamera:\n  profile: realsense-d435\n");
  EXPECT_FLOAT_EQ(config.odometry.alignment.noise.factor_per_m, 0.003f);
  EXPECT_FLOAT_EQ(config.odometry.alignment.noise.floor_m, 0.001f);
}

}  // namespace
}  // namespace comap
