// ROS 2's own messages, as far as robots and core send them: plain values, and their bytes on the wire.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "protocol/types/pose.h"

namespace comap::ros2 {

/// Frames and axes here are those of ROS (x forward, y left, z up), except below a camera's frame.
struct Header {
  int64_t stamp_ns = 0;
  std::string frame;
};

/// nav_msgs/Odometry: pose of `child_frame` in the header's frame, velocities (m/s, rad/s) in `child_frame`. The
/// covariances are zero, which in ROS means that they are not told.
struct Odometry {
  Header header;
  std::string child_frame;
  Pose pose;
  Eigen::Vector3d linear_mps = Eigen::Vector3d::Zero(), angular_radps = Eigen::Vector3d::Zero();
};

/// geometry_msgs/TransformStamped: the pose of `child_frame` in the header's frame.
struct Transform {
  Header header;
  std::string child_frame;
  Pose pose;
};

/// nav_msgs/Path.
struct Path {
  Header header;
  std::vector<Transform> poses;  ///< their child frames are not told
};

/// sensor_msgs/PointCloud2 with x, y, z (float32, metres) and rgb (packed, as rviz reads it).
struct PointCloud {
  struct Point {
    float x, y, z;
    uint8_t r, g, b;
  };
  Header header;
  std::vector<Point> points;
};

/// Plain CDR, little-endian, with its four bytes of encapsulation.
std::vector<uint8_t> serialise(const Odometry& message);
std::vector<uint8_t> serialise(const std::vector<Transform>& message);  ///< tf2_msgs/TFMessage
std::vector<uint8_t> serialise(const Path& message);
std::vector<uint8_t> serialise(const PointCloud& message);
std::vector<uint8_t> serialise(const std::string& message);  ///< std_msgs/String

/// A robot's name as ROS allows it in topics and frames: letters, digits and _, no digit first.
std::string rosName(const std::string& robot);

/// A pose between frames with camera axes (x right, y down, z forward), as one between frames with ROS' axes.
Pose rosPose(const Pose& T);
/// From camera axes to ROS' axes: the pose of a camera's frame in a body that looks the same way.
Pose rosFromCamera();

}  // namespace comap::ros2
