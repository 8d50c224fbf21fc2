#include "protocol/ros2/messages.h"

#include <gtest/gtest.h>

namespace comap::ros2 {
namespace {

TEST(Ros2Messages, StringIsAsTheStandardHasIt) {
  const std::vector<uint8_t> expected{0, 1, 0, 0, 3, 0, 0, 0, 'o', 'k', 0};
  EXPECT_EQ(serialise(std::string("ok")), expected);
}

TEST(Ros2Messages, StampsBeforeTheEpochKeepPositiveNanoseconds) {
  const auto bytes = serialise(std::vector<Transform>{{{-1, "m"}, "c", Pose()}});
  ASSERT_GE(bytes.size(), 16u);
  EXPECT_EQ((std::vector<uint8_t>(bytes.begin() + 8, bytes.begin() + 16)),
            (std::vector<uint8_t>{0xff, 0xff, 0xff, 0xff, 0xff, 0xc9, 0x9a, 0x3b}));  // -1 s and 999 999 999 ns
}

TEST(Ros2Messages, AxesAreThoseOfRos) {
  // A camera that moves forward, right and up.
  const Pose T(Eigen::Quaterniond::Identity(), Eigen::Vector3d(1, -2, 3));
  const Pose ros = rosPose(T);
  EXPECT_TRUE(ros.translation().isApprox(Eigen::Vector3d(3, -1, 2), 1e-12)) << ros.translation().transpose();
  // Turning right, about the camera's y axis, is turning about -z.
  const Pose turned(Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitY())), Eigen::Vector3d::Zero());
  const Eigen::AngleAxisd turn(Eigen::Quaterniond(rosPose(turned).rotation()));
  EXPECT_TRUE((turn.axis() * turn.angle()).isApprox(Eigen::Vector3d(0, 0, -0.3), 1e-12));
  // What the camera sees straight ahead lies in front of the body.
  EXPECT_TRUE((rosFromCamera() * Eigen::Vector3d(0, 0, 2)).isApprox(Eigen::Vector3d(2, 0, 0), 1e-12));
}

TEST(Ros2Messages, NamesBecomeWhatTopicsMayHold) {
  EXPECT_EQ(rosName("a"), "a");
  EXPECT_EQ(rosName("robot-1_b"), "robot_1_b");
  EXPECT_EQ(rosName("7up"), "robot_7up");
}

TEST(Ros2Messages, ManyPointsFillTheirBytes) {
  PointCloud cloud{{5, "map/x"}, {}};
  for (int i = 0; i < 1000; ++i) cloud.points.push_back({1, 2, 3, 10, 20, 30});
  const auto bytes = serialise(cloud);
  EXPECT_GT(bytes.size(), 16000u);
  EXPECT_LT(bytes.size(), 16200u);
}

}  // namespace
}  // namespace comap::ros2
