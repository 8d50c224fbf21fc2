#include "edge_agent/ros2_output.h"

#include "edge_agent/agent_metrics.h"

namespace comap {
namespace {

constexpr size_t kLongestPath = 2000;  // poses; a message of 170 kB

ros2::Transform transform(int64_t stamp_ns, const std::string& frame, const std::string& child, const Pose& pose) {
  ros2::Transform result;
  result.header.stamp_ns = stamp_ns;
  result.header.frame = frame;
  result.child_frame = child;
  result.pose = pose;
  return result;
}

}  // namespace

Ros2Output::Ros2Output(std::unique_ptr<ros2::Ros2Node> node, const std::string& robot)
    : node_(std::move(node)), robot_(ros2::rosName(robot)) {}

Result<Ros2Output> Ros2Output::start(const ros2::Ros2Options& options, int fleet_domain, const std::string& robot) {
  auto node = ros2::Ros2Node::start(options, fleet_domain);
  if (!node) return node.error();
  Ros2Output output(std::move(*node), robot);
  const std::vector<ros2::Transform> fixed(
      1, transform(0, output.robot_ + "/base_link", output.robot_ + "/camera", ros2::rosFromCamera()));
  output.node_->publish("tf_static", "tf2_msgs/msg/TFMessage", ros2::Durability::kLatched, ros2::serialise(fixed));
  return output;
}

void Ros2Output::follow(const Agent& agent) {
  const AgentStatistics& statistics = agent.statistics();
  if (statistics.frames == frames_) return;
  frames_ = statistics.frames;
  if (told_ != agent.tracking()) {
    told_ = agent.tracking();
    node_->publish(robot_ + "/tracking_state", "std_msgs/msg/String", ros2::Durability::kLatched,
                   ros2::serialise(std::string(trackingName(*told_))));
  }
  if (agent.tracking() == TrackingState::kLost) {  // it stands nowhere
    last_.reset();
    return;
  }
  publishOdometry(agent, statistics.last_stamp_ns);
  publishFrames(agent, statistics.last_stamp_ns);
  if (statistics.keyframes != keyframes_) publishPath(agent, statistics.last_stamp_ns);
  keyframes_ = statistics.keyframes;
}

void Ros2Output::publishOdometry(const Agent& agent, int64_t stamp_ns) {
  ros2::Odometry odometry;
  odometry.header = {stamp_ns, robot_ + "/odom"};
  odometry.child_frame = robot_ + "/base_link";
  odometry.pose = ros2::rosPose(agent.odometryPose());
  if (last_ && stamp_ns > last_->stamp_ns) {
    const double seconds = 1e-9 * static_cast<double>(stamp_ns - last_->stamp_ns);
    const Pose step = last_->T_odom_base.inverse() * odometry.pose;
    const Eigen::AngleAxisd turn(Eigen::Quaterniond(step.rotation()));
    odometry.linear_mps = step.translation() / seconds;
    odometry.angular_radps = turn.axis() * turn.angle() / seconds;
  }
  last_ = Last{stamp_ns, odometry.pose};
  node_->publish(robot_ + "/odom", "nav_msgs/msg/Odometry", ros2::Durability::kStream, ros2::serialise(odometry));
}

void Ros2Output::publishFrames(const Agent& agent, int64_t stamp_ns) {
  const Pose T_odom_cam = agent.odometryPose();
  std::vector<ros2::Transform> frames;
  frames.push_back(transform(stamp_ns, robot_ + "/odom", robot_ + "/base_link", ros2::rosPose(T_odom_cam)));
  const LivePose live = agent.livePose();
  if (!live.map.empty())
    frames.push_back(
        {{stamp_ns, "map/" + live.map}, robot_ + "/odom", ros2::rosPose(live.T_map_cam * T_odom_cam.inverse())});
  node_->publish("tf", "tf2_msgs/msg/TFMessage", ros2::Durability::kFrames, ros2::serialise(frames));
}

void Ros2Output::publishPath(const Agent& agent, int64_t stamp_ns) {
  path_.push_back(transform(stamp_ns, robot_ + "/odom", "", ros2::rosPose(agent.odometryPose())));
  if (path_.size() > kLongestPath) path_.pop_front();
  ros2::Path path;
  path.header = path_.back().header;
  path.poses.assign(path_.begin(), path_.end());
  node_->publish(robot_ + "/path", "nav_msgs/msg/Path", ros2::Durability::kLatched, ros2::serialise(path));
}

}  // namespace comap
