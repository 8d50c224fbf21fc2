// What other programs on the robot see of its agent: the latest pose, and the tiles held.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "edge_agent/agent.h"
#include "edge_agent/api/api_server.h"

namespace comap {

/// Thread rule: one thread.
class ApiOutput {
 public:
  using Log = std::function<void(const std::string& line)>;
  /// Errors are ApiSocket's.
  static Result<ApiOutput> start(const ApiOptions& options, const std::string& robot, uint64_t session);

  /// Publishes what is new since the last call, pose and tiles together.
  void follow(const Agent& agent, const Log& log);

 private:
  explicit ApiOutput(std::unique_ptr<ApiServer> server) : server_(std::move(server)) {}

  std::unique_ptr<ApiServer> server_;
  ApiState last_;
  uint64_t tile_changes_ = 0;
};

}  // namespace comap
