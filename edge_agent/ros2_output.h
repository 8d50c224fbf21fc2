// What ROS 2 programs see of a robot: /NAME/odom, /NAME/path, /NAME/tracking_state, /tf and /tf_static.
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <string>

#include "edge_agent/agent.h"
#include "protocol/ros2/messages.h"
#include "protocol/ros2/ros2_node.h"

namespace comap {

/// NAME is the robot's as ROS allows it (rosName). Frames, after REP-105: map/ID -> NAME/odom -> NAME/base_link ->
/// NAME/camera. ID is the joint map's name; when maps are joined or the graph moves them only map/ID -> NAME/odom
/// jumps. base_link is the camera with ROS' axes. Thread rule: one thread.
class Ros2Output {
 public:
  static Result<Ros2Output> start(const ros2::Ros2Options& options, int fleet_domain, const std::string& robot);

  /// Publishes what is new since the last call.
  void follow(const Agent& agent);

 private:
  Ros2Output(std::unique_ptr<ros2::Ros2Node> node, const std::string& robot);
  void publishOdometry(const Agent& agent, int64_t stamp_ns);
  void publishFrames(const Agent& agent, int64_t stamp_ns);
  void publishPath(const Agent& agent, int64_t stamp_ns);

  std::unique_ptr<ros2::Ros2Node> node_;
  std::string robot_;
  uint32_t frames_ = 0, keyframes_ = 0;
  std::optional<TrackingState> told_;
  struct Last {
    int64_t stamp_ns;
    Pose T_odom_base;
  };
  std::optional<Last> last_;
  std::deque<ros2::Transform> path_;
};

}  // namespace comap
