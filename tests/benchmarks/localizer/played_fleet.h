// A core and robots in one process, step by step, so that a benchmark can look at what a robot believes after each
// frame, and let the core be late or silent.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "edge_agent/agent.h"
#include "mapping_core/service/mapping_service.h"
#include "protocol/link/loopback_link.h"

namespace comap {

/// Thread rule: one thread. Its store lies in a folder of its own that goes with it.
class PlayedFleet {
 public:
  using Log = std::function<void(const std::string& line)>;
  PlayedFleet(gpu::Device& device, Log log);
  ~PlayedFleet();

  struct Robot {
    std::string name;
    std::unique_ptr<Link> link;
    std::unique_ptr<Agent> agent;
  };
  /// Robots are greeted as they come.
  Result<Robot*> add(const std::string& name, FrameSource& source, bool localizer);

  /// One frame. False if the source has ended.
  Result<bool> takeFrame(Robot& robot);
  /// The core does all there is to do, and the robot hears of it.
  Result<void> serve(Robot& robot);
  /// A robot's whole recording, the core never late; then its tiles.
  Result<void> playAll(Robot& robot);

 private:
  Result<void> drain();

  Log log_;
  std::filesystem::path folder_;
  LoopbackHub hub_;
  std::optional<MapStore> store_;
  std::unique_ptr<Link> core_link_;
  std::unique_ptr<MappingService> service_;
  std::vector<std::unique_ptr<Robot>> robots_;
  uint64_t sessions_ = 0;
};

}  // namespace comap
