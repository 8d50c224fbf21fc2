#include "protocol/ros2/ros2_node.h"

#include <arpa/inet.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <netinet/in.h>
#include <spdlog/fmt/fmt.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstring>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <map>
#include <vector>

#include "protocol/config/yaml_text.h"

namespace comap::ros2 {
namespace {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;
using ReturnCode_t = eprosima::fastrtps::types::ReturnCode_t;

// Any of ROS' types, whose samples are serialised already.
class SerialisedType : public dds::TopicDataType {
 public:
  explicit SerialisedType(const std::string& name) {
    setName(name.c_str());
    m_typeSize = 4096;  // a first guess at a sample's size; histories grow beyond it
    m_isGetKeyDefined = false;
  }
  bool serialize(void* data, rtps::SerializedPayload_t* to) override {
    const auto& bytes = *static_cast<const std::vector<uint8_t>*>(data);
    if (to->max_size < bytes.size()) return false;
    std::memcpy(to->data, bytes.data(), bytes.size());
    to->encapsulation = CDR_LE;
    to->length = static_cast<uint32_t>(bytes.size());
    return true;
  }
  bool deserialize(rtps::SerializedPayload_t*, void*) override { return false; }  // nothing is read
  std::function<uint32_t()> getSerializedSizeProvider(void* data) override {
    return [data] { return static_cast<uint32_t>(static_cast<const std::vector<uint8_t>*>(data)->size()); };
  }
  void* createData() override { return new std::vector<uint8_t>; }
  void deleteData(void* data) override { delete static_cast<std::vector<uint8_t>*>(data); }
  bool getKey(void*, rtps::InstanceHandle_t*, bool) override { return false; }
};

dds::DomainParticipantQos participantQos(const std::string& address) {
  constexpr uint32_t kBuffer_bytes = 4u << 20;
  dds::DomainParticipantQos qos = dds::PARTICIPANT_QOS_DEFAULT;
  qos.name("comap");
  qos.transport().use_builtin_transports = false;
  auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList = {address};
  udp->sendBufferSize = kBuffer_bytes;
  udp->maxInitialPeersRange = 16;  // participants of one machine that are asked without multicast
  qos.transport().user_transports = {udp};
  if (address.starts_with("127.")) {  // no multicast there: ROS' programs are asked by their usual ports
    rtps::Locator_t peer;
    rtps::IPLocator::setIPv4(peer, address);
    qos.wire_protocol().builtin.initialPeersList.push_back(peer);
  }
  return qos;
}

// "nav_msgs/msg/Odometry" is nav_msgs::msg::dds_::Odometry_ on the wire.
std::string wireType(const std::string& type) {
  std::string name = type;
  for (size_t at = name.find('/'); at != std::string::npos; at = name.find('/')) name.replace(at, 1, "::");
  const size_t last = name.rfind("::") + 2;
  return name.substr(0, last) + "dds_::" + name.substr(last) + "_";
}

int depthOf(Durability durability) {
  switch (durability) {
    case Durability::kLatched:
      return 1;
    case Durability::kParts:
      return 50;
    case Durability::kFrames:
      return 100;
    default:
      return 10;
  }
}

dds::DataWriterQos writerQos(Durability durability) {
  dds::DataWriterQos qos = dds::DATAWRITER_QOS_DEFAULT;
  qos.reliability().kind = dds::RELIABLE_RELIABILITY_QOS;
  qos.reliability().max_blocking_time = eprosima::fastrtps::Duration_t(0, 1'000'000);  // frames do not wait for viewers
  qos.durability().kind = durability == Durability::kLatched || durability == Durability::kParts
                              ? dds::TRANSIENT_LOCAL_DURABILITY_QOS
                              : dds::VOLATILE_DURABILITY_QOS;
  qos.history().kind = dds::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = depthOf(durability);
  qos.publish_mode().kind = dds::ASYNCHRONOUS_PUBLISH_MODE;
  qos.endpoint().history_memory_policy = rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  return qos;
}

}  // namespace

Result<void> checkRos2Options(const Ros2Options& options, int fleet_domain) {
  if (options.domain == fleet_domain)
    return Error{ErrorCode::kWrongUse, "ros2.domain is " + std::to_string(options.domain) +
                                           ", as link.domain: ROS' programs would hear all keyframes; choose another"};
  // Fast DDS would go on with an address that is not there, and send nothing.
  sockaddr_in address{};
  address.sin_family = AF_INET;
  const int fd = socket(AF_INET, SOCK_DGRAM, 0);
  const bool ours = inet_pton(AF_INET, options.interface_address.c_str(), &address.sin_addr) == 1 &&
                    address.sin_addr.s_addr != htonl(INADDR_ANY) &&
                    bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  close(fd);
  if (!ours)
    return Error{ErrorCode::kUnreachable,
                 "ros2.interface_address '" + options.interface_address + "' is no IPv4 address of this machine"};
  return {};
}

void readRos2Options(ConfigReader& reader, Ros2Options& options) {
  ConfigReader ros2 = reader.section("ros2");
  ros2.read("enabled", options.enabled);
  ros2.read("domain", options.domain, 0, 101);
  ros2.read("interface_address", options.interface_address);
  ros2.read("map_points_per_s", options.map_points_per_s, 1000, 10'000'000);
}

std::string printRos2Options(const Ros2Options& options) {
  return fmt::format(
      R"(ros2:                    # topics that rviz2 and other ROS 2 programs read, without ROS here
  enabled: {}
  domain: {}                # their ROS_DOMAIN_ID
  interface_address: {}  # clear text: beyond this machine for a trusted network alone
  map_points_per_s: {}  # of /fleet/map, at most; published by the core
)",
      options.enabled, options.domain, yamlText(options.interface_address), options.map_points_per_s);
}

struct Ros2Node::State {
  dds::DomainParticipant* participant = nullptr;
  dds::Publisher* publisher = nullptr;
  std::map<std::string, dds::DataWriter*> writers;  // by topic

  dds::DataWriter* writerOf(const std::string& topic, const std::string& type, Durability durability) {
    if (const auto known = writers.find(topic); known != writers.end()) return known->second;
    const std::string name = wireType(type);
    if (participant->find_type(name).empty()) dds::TypeSupport(new SerialisedType(name)).register_type(participant);
    dds::Topic* created = participant->create_topic("rt/" + topic, name, dds::TOPIC_QOS_DEFAULT);
    dds::DataWriter* writer =
        created == nullptr ? nullptr : publisher->create_datawriter(created, writerQos(durability));
    if (writer != nullptr) writers[topic] = writer;
    return writer;
  }
};

Ros2Node::Ros2Node(std::unique_ptr<State> state) : state_(std::move(state)) {}

Result<std::unique_ptr<Ros2Node>> Ros2Node::start(const Ros2Options& options, int fleet_domain) {
  if (auto checked = checkRos2Options(options, fleet_domain); !checked) return checked.error();
  auto state = std::make_unique<State>();
  state->participant = dds::DomainParticipantFactory::get_instance()->create_participant(
      static_cast<uint32_t>(options.domain), participantQos(options.interface_address));
  if (state->participant != nullptr)
    state->publisher = state->participant->create_publisher(dds::PUBLISHER_QOS_DEFAULT);
  std::unique_ptr<Ros2Node> node(new Ros2Node(std::move(state)));
  if (node->state_->publisher == nullptr)
    return Error{ErrorCode::kUnreachable, "ROS 2 domain " + std::to_string(options.domain) + " at " +
                                              options.interface_address +
                                              " cannot be joined: is ros2.interface_address of this machine?"};
  return node;
}

Ros2Node::~Ros2Node() {
  if (state_->participant == nullptr) return;
  state_->participant->delete_contained_entities();
  dds::DomainParticipantFactory::get_instance()->delete_participant(state_->participant);
}

bool Ros2Node::publish(const std::string& topic, const std::string& type, Durability durability,
                       std::span<const uint8_t> bytes) {
  dds::DataWriter* writer = state_->writerOf(topic, type, durability);
  if (writer == nullptr) return false;
  std::vector<uint8_t> sample(bytes.begin(), bytes.end());
  return writer->write(&sample);
}

Ros2Node::Readers Ros2Node::readers(const std::string& topic) const {
  const auto known = state_->writers.find(topic);
  if (known == state_->writers.end()) return {};
  dds::PublicationMatchedStatus status;
  known->second->get_publication_matched_status(status);
  return {status.current_count, status.total_count};
}

}  // namespace comap::ros2
