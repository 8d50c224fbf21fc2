// Topics that ROS 2 programs on the same network see as their own (rviz2, ros2 topic echo), without ROS installed here.
// Names, types and delivery follow ROS' conventions: topic /a/odom is the DDS topic rt/a/odom.
#pragma once

#include <memory>
#include <span>
#include <string>

#include "protocol/config/config_reader.h"
#include "protocol/types/result.h"

namespace comap::ros2 {

struct Ros2Options {
  bool enabled = false;
  int domain = 0;                               ///< ROS_DOMAIN_ID; never the one of robots and core
  std::string interface_address = "127.0.0.1";  ///< clear text: what leaves this machine is for a trusted network
  uint32_t map_points_per_s = 100'000;          ///< of /fleet/map, at most
};

/// kWrongUse if `domain` is also that of the fleet's own messages, kUnreachable if the address is not this machine's.
Result<void> checkRos2Options(const Ros2Options& options, int fleet_domain);

/// Reads the section `ros2`.
void readRos2Options(ConfigReader& reader, Ros2Options& options);
/// The same section as commented YAML.
std::string printRos2Options(const Ros2Options& options);

enum class Durability {
  kStream,   ///< reliable, volatile, last 10: readers that miss some go on
  kLatched,  ///< reliable, transient local, last 1: late readers get the last one
  kParts,    ///< reliable, transient local, last 50: messages that belong together
  kFrames,   ///< of /tf: reliable, volatile, last 100
};

/// Thread rule: one thread.
class Ros2Node {
 public:
  /// Errors of checkRos2Options; kUnreachable if the domain cannot be joined.
  static Result<std::unique_ptr<Ros2Node>> start(const Ros2Options& options, int fleet_domain);
  ~Ros2Node();
  Ros2Node(const Ros2Node&) = delete;
  Ros2Node& operator=(const Ros2Node&) = delete;

  /// Publishes serialised bytes on a topic such as "a/odom", of a type such as "nav_msgs/msg/Odometry". Delivery and
  /// type of a topic are those of its first message. False if it could not be taken: ROS' readers get the next one.
  bool publish(const std::string& topic, const std::string& type, Durability delivery, std::span<const uint8_t> bytes);

  struct Readers {
    int now = 0, ever = 0;
  };
  /// Of a topic; none if nothing was published on it.
  Readers readers(const std::string& topic) const;

 private:
  struct State;
  explicit Ros2Node(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace comap::ros2
