// The one address that participants of a site know: tells those who announce themselves of each other. What they then
// say goes from one to the other without it.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "protocol/discovery/endpoint.h"

namespace comap {

/// Serves from a thread of its own until destroyed. Several sites may use one server; it introduces nobody to another
/// site. It needs no keys: what it sees is what DDS announces in clear anyway, and who is introduced proves himself to
/// the other as ever.
class DiscoveryServer {
 public:
  /// `tell`: lines for the log, from the server's thread. Port 0: any. kUnreachable if the port is taken or the address
  /// not this machine's.
  static Result<std::unique_ptr<DiscoveryServer>> start(const Endpoint& own,
                                                        std::function<void(const std::string&)> tell);
  ~DiscoveryServer();
  DiscoveryServer(const DiscoveryServer&) = delete;
  DiscoveryServer& operator=(const DiscoveryServer&) = delete;

  uint16_t port() const;

 private:
  struct Shared;
  explicit DiscoveryServer(std::unique_ptr<Shared> shared);
  std::unique_ptr<Shared> shared_;
  std::jthread thread_;
};

}  // namespace comap
