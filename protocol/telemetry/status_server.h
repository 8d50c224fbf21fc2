// A small HTTP server that tells how a program does: /metrics for Prometheus, /healthz and /readyz for those who start
// and stop it.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "protocol/types/result.h"

namespace comap {

struct Readiness {
  bool ready = false;  ///< does what it is there for
  std::string state;   ///< one line for people
};

/// Thread rule: publish() from one thread; requests are answered by the server's own, which touch nothing but what was
/// published last.
class StatusServer {
 public:
  /// How long a program that has begun its work may publish nothing before it counts as stuck.
  static constexpr std::chrono::seconds kPatience{60};

  /// `port` 0 takes any that is free. kUnreachable if the address cannot be listened on, with the reason.
  static Result<std::unique_ptr<StatusServer>> start(const std::string& address, int port,
                                                     std::chrono::milliseconds patience = kPatience);
  ~StatusServer();
  StatusServer(const StatusServer&) = delete;
  StatusServer& operator=(const StatusServer&) = delete;

  /// What /metrics and /readyz say from now on. Until the first time the program is healthy, and not ready.
  void publish(std::string metrics, Readiness readiness);

  int port() const { return port_; }

 private:
  struct Page;
  StatusServer();
  std::unique_ptr<Page> page_;
  void* context_ = nullptr;  // of the HTTP library
  int port_ = 0;
};

}  // namespace comap
