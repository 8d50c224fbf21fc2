#include "protocol/link/qos.h"

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>

#include <algorithm>
#include <memory>

#include "protocol/link/security.h"
#include "protocol/link/topics.h"

namespace comap {
namespace {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastdds::rtps;

constexpr uint32_t kSocketBufferBytes = 4u << 20;
constexpr uint32_t kDatagramBytes = 1400;
constexpr int kGlance_ms = 10;              // DDS itself holds a writer for moments
constexpr uint32_t kPeersOfOneAddress = 8;  // participants on one machine that are looked for

// Samples kept per robot, and robots.
struct Depth {
  bool keep_all;
  int per_robot;
  int robots;
};

Depth depthOf(Topic topic) {
  switch (topic) {
    case Topic::kKeyframe:
      return {true, 16, 64};
    case Topic::kTile:
      return {true, 256, 64};  // what a few keyframes change, for a reader that looks once a frame
    case Topic::kInterest:
      return {true, 2, 256};
    case Topic::kVerdict:
    case Topic::kMerge:
      return {false, static_cast<int>(latchedDepth(topic)), 4};
    default:
      return {false, 1, 256};
  }
}

// What readers and writers have in common.
template <class Qos>
void setCommon(Topic topic, Qos& qos) {
  const Depth depth = depthOf(topic);
  qos.reliability().kind = dds::RELIABLE_RELIABILITY_QOS;
  qos.durability().kind = latchedDepth(topic) > 0 ? dds::TRANSIENT_LOCAL_DURABILITY_QOS : dds::VOLATILE_DURABILITY_QOS;
  qos.history().kind = depth.keep_all ? dds::KEEP_ALL_HISTORY_QOS : dds::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = depth.per_robot;
  qos.resource_limits().max_samples_per_instance = depth.per_robot;
  qos.resource_limits().max_instances = depth.robots;
  qos.resource_limits().max_samples = depth.per_robot * depth.robots;
  qos.resource_limits().allocated_samples = 4;
  qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  qos.data_sharing().off();
}

}  // namespace

dds::DomainParticipantQos participantQos(const std::string& name, const DdsLinkOptions& options,
                                         uint16_t introducer_port) {
  dds::DomainParticipantQos qos;
  qos.name(name);
  const std::string profile = profileOf(options);
  // UDP alone, also on one machine: a process that is killed leaves its ports in shared memory as they were, its
  // successor takes the same ones, and peers go on writing into the old.
  auto udp = std::make_shared<rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList.push_back(options.interface_address);
  udp->sendBufferSize = kSocketBufferBytes;
  udp->receiveBufferSize = kSocketBufferBytes;
  udp->maxInitialPeersRange = kPeersOfOneAddress;
  if (profile != "local") udp->maxMessageSize = kDatagramBytes;
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(udp);
  qos.transport().send_socket_buffer_size = kSocketBufferBytes;
  qos.transport().listen_socket_buffer_size = kSocketBufferBytes;
  auto& builtin = qos.wire_protocol().builtin;
  builtin.discovery_config.leaseDuration = eprosima::fastrtps::Duration_t(kLease_s, 0);
  builtin.discovery_config.leaseDuration_announcementperiod = eprosima::fastrtps::Duration_t(kLease_s / 5, 0);
  if (profile == "wan" || introducer_port != 0) {
    // With a listening address of its own and someone to write to, a participant neither joins nor uses multicast.
    eprosima::fastrtps::rtps::Locator_t own;
    eprosima::fastrtps::rtps::IPLocator::setIPv4(own, options.interface_address);
    builtin.metatrafficUnicastLocatorList.push_back(own);
    const auto lookAt = [&builtin](const std::string& address, uint16_t port) {
      eprosima::fastrtps::rtps::Locator_t peer;
      eprosima::fastrtps::rtps::IPLocator::setIPv4(peer, address);
      peer.port = port;
      builtin.initialPeersList.push_back(peer);
    };
    if (introducer_port != 0) lookAt(options.interface_address, introducer_port);
    // A core looks to its own address, where there is nobody else: robots come to it.
    if (introducer_port == 0 || !options.core_address.empty())
      lookAt(options.core_address.empty() ? options.interface_address : options.core_address, 0);
  }
  secure(options, qos);
  return qos;
}

int maxBlocking_ms(Topic topic, int max_blocking_ms) {
  return topic == Topic::kKeyframe ? max_blocking_ms : std::min(max_blocking_ms, kGlance_ms);
}

dds::DataWriterQos writerQos(Topic topic, int max_blocking_ms) {
  dds::DataWriterQos qos = dds::DATAWRITER_QOS_DEFAULT;
  setCommon(topic, qos);
  const int blocking_ms = maxBlocking_ms(topic, max_blocking_ms);
  qos.reliability().max_blocking_time =
      eprosima::fastrtps::Duration_t(blocking_ms / 1000, static_cast<uint32_t>(blocking_ms % 1000) * 1'000'000);
  qos.publish_mode().kind = dds::ASYNCHRONOUS_PUBLISH_MODE;
  qos.reliable_writer_qos().times.heartbeatPeriod = eprosima::fastrtps::Duration_t(0, 100'000'000);
  qos.reliable_writer_qos().times.nackResponseDelay = eprosima::fastrtps::Duration_t(0, 1'000'000);
  return qos;
}

dds::DataReaderQos readerQos(Topic topic) {
  dds::DataReaderQos qos = dds::DATAREADER_QOS_DEFAULT;
  setCommon(topic, qos);
  return qos;
}

}  // namespace comap
