// A participant's side: takes what its own DDS announces to the discovery server, and what the server tells of others
// to its own DDS.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "protocol/discovery/announcement.h"
#include "protocol/discovery/endpoint.h"
#include "protocol/discovery/note.h"

namespace comap {

struct DiscoveryClientOptions {
  std::string server;     ///< HOST or HOST:PORT; a name is asked for anew while its server does not answer
  std::string interface;  ///< IPv4 address that DDS uses
  int domain = 0;
  std::string site;
  MemberRole role = MemberRole::kRobot;
  std::function<void(const std::string&)> notice = {};  ///< a line when the server falls silent, and when it answers
};

/// Works from a thread of its own until destroyed; then the server forgets the participant. A server that is not there
/// is tried for ever; so is one that was started anew.
class DiscoveryClient {
 public:
  /// Errors: kWrongUse for `server`, kUnreachable if the interface's address is not this machine's.
  static Result<std::unique_ptr<DiscoveryClient>> start(DiscoveryClientOptions options);
  ~DiscoveryClient();
  DiscoveryClient(const DiscoveryClient&) = delete;
  DiscoveryClient& operator=(const DiscoveryClient&) = delete;

  /// Where DDS is to send its announcements: this port of the interface.
  uint16_t port() const;
  /// Whose announcements are passed on; none before it is said.
  void follow(const ParticipantPrefix& participant);
  /// Why nobody is found, in a sentence; empty while the server answers.
  std::string trouble() const;

 private:
  class Work;
  explicit DiscoveryClient(std::unique_ptr<Work> work);
  std::unique_ptr<Work> work_;
  std::jthread thread_;
};

}  // namespace comap
