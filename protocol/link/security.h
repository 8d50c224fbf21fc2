// A link with keys (DDS Security): who may join, and whether a message comes from whom it says. Inside the link only.
#pragma once

#include <chrono>
#include <fastdds/dds/domain/DomainParticipantListener.hpp>
#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <fastdds/rtps/common/GuidPrefix_t.hpp>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>

#include "protocol/keys/participant.h"
#include "protocol/link/dds_link.h"

namespace comap {

/// A name that a stranger gave, fit for a log: its first 64 characters, what is no name's replaced by '?'.
std::string safeName(std::string name);

/// Checks options.keys, if any, and whether they are for this role, robot and site. Errors say what to check.
Result<void> checkKeys(const DdsLinkOptions& options);

/// Without keys the QoS stays as it is.
void secure(const DdsLinkOptions& options, eprosima::fastdds::dds::DomainParticipantQos& qos);

/// Room for the handshake in which participants show their certificates and permissions (3.5 kB): Fast DDS 2.9 takes
/// its buffers in the size of a datagram and fails to write what fills one exactly, so on links with small datagrams
/// nobody would ever be let in. Participants of a process share these buffers, and the first one gives their size: one
/// that talks to nobody makes them large. To be held while the participant is created.
class HandshakeRoom {
 public:
  explicit HandshakeRoom(const DdsLinkOptions& options);
  ~HandshakeRoom();
  HandshakeRoom(const HandshakeRoom&) = delete;
  HandshakeRoom& operator=(const HandshakeRoom&) = delete;

 private:
  eprosima::fastdds::dds::DomainParticipant* participant_ = nullptr;
};

/// Whether a participant with this GUID may have written in the name of a robot, or a tool: with keys, only who has
/// authenticated itself as that; without keys, anyone.
class Authorship {
 public:
  explicit Authorship(const DdsLinkOptions& options) : site_(options.site), secured_(!options.keys.empty()) {}
  bool isOf(const eprosima::fastrtps::rtps::GuidPrefix_t& writer, KeyRole role, const std::string& name) const;

 private:
  const std::string site_;
  const bool secured_;
};

/// Tells each participant that is not let in, or will not let us in, once. Called from DDS's threads.
class JoinWatch : public eprosima::fastdds::dds::DomainParticipantListener {
 public:
  explicit JoinWatch(const DdsLinkOptions& options);
  void onParticipantAuthentication(eprosima::fastdds::dds::DomainParticipant*,
                                   eprosima::fastrtps::rtps::ParticipantAuthenticationInfo&& info) override;
  void on_participant_discovery(eprosima::fastdds::dds::DomainParticipant*,
                                eprosima::fastrtps::rtps::ParticipantDiscoveryInfo&& info) override;

  /// How long a core has been in sight, of this site or another, but with keys only if they are of the same authority;
  /// nothing if none is.
  std::optional<std::chrono::steady_clock::duration> coreInSight() const;

 protected:
  /// Those cores.
  std::set<eprosima::fastrtps::rtps::GuidPrefix_t> coresInSight() const;

 private:
  std::string nameOf(const eprosima::fastrtps::rtps::GuidPrefix_t& who);
  void tellOnce(const eprosima::fastrtps::rtps::GuidPrefix_t& who, const std::string& text);

  const bool secured_;
  const std::string authority_;  // as it is announced
  const std::function<void(const std::string&)> notice_;
  mutable std::mutex mutex_;
  std::set<eprosima::fastrtps::rtps::GuidPrefix_t> told_;
  std::map<eprosima::fastrtps::rtps::GuidPrefix_t, std::chrono::steady_clock::time_point> cores_;  // in sight since
  std::map<eprosima::fastrtps::rtps::GuidPrefix_t, std::string> names_;  // as those give them that are there
};

}  // namespace comap
