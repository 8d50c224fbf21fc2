// Lets programs on the robot read where it is and what it holds of the map.
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "edge_agent/api/api_reader.h"
#include "edge_agent/api/api_socket.h"
#include "edge_agent/api/api_state.h"

namespace comap {

/// Thread rule: one thread publishes. Readers are served by a thread of the server's own, of lower priority, which
/// shares with it nothing but what was published last: publishing takes the same time whatever readers do.
class ApiServer {
 public:
  static constexpr size_t kMostReaders = 16;

  /// Errors are ApiSocket's.
  static Result<std::unique_ptr<ApiServer>> start(const ApiOptions& options, const robot_api::Greeting& greeting);
  ApiServer(const ApiServer&) = delete;
  ApiServer& operator=(const ApiServer&) = delete;
  ~ApiServer();

  void publish(ApiState state);
  /// What is worth a line in the log since the last call.
  std::vector<std::string> takeNews();

 private:
  ApiServer(ApiSocket socket, const robot_api::Greeting& greeting, int bell);
  void serve();
  bool letIn(ApiReader::Clock::time_point now);
  void note(std::string line);

  ApiSocket socket_;
  const robot_api::Greeting greeting_;
  const int bell_;  // rung when something was published
  std::atomic<bool> stop_{false};
  std::mutex mutex_;
  std::shared_ptr<const ApiState> state_ = std::make_shared<ApiState>();  // under mutex_
  std::vector<std::string> news_;                                         // under mutex_
  std::vector<ApiReader> readers_;                                        // the server's thread
  std::thread thread_;
};

}  // namespace comap
