#include "protocol/link/dds_link.h"

#include <arpa/inet.h>
#include <fastrtps/xmlparser/XMLProfileManager.h>
#include <net/if.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <limits>
#include <map>
#include <mutex>
#include <vector>

#include "protocol/discovery/discovery_client.h"
#include "protocol/link/octets_type.h"
#include "protocol/link/qos.h"
#include "protocol/link/roaming_link.h"
#include "protocol/link/round_trips.h"
#include "protocol/link/security.h"
#include "protocol/link/topics.h"
#include "protocol/types/ids.h"

namespace comap {
namespace {

namespace dds = eprosima::fastdds::dds;
using eprosima::fastrtps::types::ReturnCode_t;

constexpr int kMaxDomain = 230;  // beyond, the standard's port numbers pass 65535
constexpr size_t kMaxRobots = 256;

// Large messages are repaired as often as small ones that are sent all the time show it to make sense.
bool isPaced(Topic topic) { return topic == Topic::kKeyframe || topic == Topic::kInterest || topic == Topic::kTile; }
bool measuresPace(Topic topic) { return topic == Topic::kStatus || topic == Topic::kAck; }

// Wakes receive; says nothing about what came.
class Bell {
 public:
  void ring() {
    {
      const std::lock_guard lock(mutex_);
      ++rings_;
    }
    rung_.notify_one();
  }
  uint64_t rings() const {
    const std::lock_guard lock(mutex_);
    return rings_;
  }
  void waitBeyond(uint64_t seen, std::chrono::steady_clock::time_point deadline) {
    std::unique_lock lock(mutex_);
    rung_.wait_until(lock, deadline, [&] { return rings_ != seen; });
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable rung_;
  uint64_t rings_ = 0;
};

// One reader and the next sample of it, taken out of DDS ahead of delivery to compare ages across topics.
class Inlet : public dds::DataReaderListener {
 public:
  /// `only_for`: the robot whose samples are taken; empty: everyone's.
  Inlet(Topic topic, std::string only_for, Bell& bell,
        std::function<bool(const Octets&, const dds::SampleInfo&)> genuine)
      : topic_(topic), only_for_(std::move(only_for)), bell_(bell), genuine_(std::move(genuine)) {}

  void on_data_available(dds::DataReader*) override {
    maybe_more_ = true;
    bell_.ring();
  }

  void setReader(dds::DataReader* reader) { reader_ = reader; }
  dds::DataReader* reader() const { return reader_; }

  /// Fills the head if it is empty and DDS holds a sample.
  void fill() {
    while (!head_ && maybe_more_) {
      maybe_more_ = false;
      // Robot by robot in turn, so that one that floods does not keep the others waiting.
      if (!takeAfter(last_robot_) && !takeAfter(dds::HANDLE_NIL)) return;
      maybe_more_ = true;
    }
  }
  bool hasHead() const { return head_.has_value(); }
  const eprosima::fastrtps::rtps::Time_t& headTime() const { return head_time_; }
  Delivery takeHead() {
    Delivery delivery = std::move(*head_);
    head_.reset();
    return delivery;
  }

 private:
  bool takeAfter(const dds::InstanceHandle_t& previous) {
    dds::LoanableSequence<Octets> samples;
    dds::SampleInfoSeq infos;
    if (reader_->take_next_instance(samples, infos, 1, previous) != ReturnCode_t::RETCODE_OK) return false;
    if (infos.length() == 1) {
      last_robot_ = infos[0].instance_handle;
      if (infos[0].valid_data && !samples[0].damaged && isForUs(samples[0].robot) && genuine_(samples[0], infos[0])) {
        head_ = Delivery{topic_, std::move(samples[0].robot), std::move(samples[0].payload)};
        head_time_ = infos[0].reception_timestamp;
      }
    }
    reader_->return_loan(samples, infos);
    return true;
  }

  bool isForUs(const std::string& robot) const { return only_for_.empty() || robot == only_for_; }

  const Topic topic_;
  const std::string only_for_;
  Bell& bell_;
  const std::function<bool(const Octets&, const dds::SampleInfo&)> genuine_;
  dds::DataReader* reader_ = nullptr;
  std::atomic<bool> maybe_more_ = true;
  dds::InstanceHandle_t last_robot_ = dds::HANDLE_NIL;
  std::optional<Delivery> head_;
  eprosima::fastrtps::rtps::Time_t head_time_;
};

class DdsLink : public Link {
 public:
  explicit DdsLink(DdsLinkOptions options) : options_(std::move(options)), authorship_(options_), joins_(options_) {}
  ~DdsLink() override;
  Result<void> open();

  Result<void> publish(Topic topic, const std::string& robot, std::span<const uint8_t> payload) override;
  bool delivered(Topic topic, const std::string& robot) const override;
  std::optional<Delivery> receive(std::chrono::milliseconds timeout) override;
  int peers() const override;
  std::string trouble() const override { return discovery_ ? discovery_->trouble() : std::string(); }

 private:
  Result<void> askServer();
  Result<void> openSubscriber(const std::vector<std::string>& partitions, dds::Subscriber*& subscriber);
  Result<void> openReader(Topic topic);
  Result<dds::DataWriter*> writerOf(Topic topic, const std::string& robot);
  Result<dds::Publisher*> publisherTo(const std::string& partition);
  void dropAbsent();
  bool dropWriters(const std::string& partition, dds::Publisher& publisher);
  bool isGenuine(Topic topic, const Octets& sample, const dds::SampleInfo& info);
  Inlet* oldestHead();
  int readersOf(const dds::DataWriter& writer) const;
  int writersOf(Topic topic) const;
  Error unreachable(const std::string& what) const {
    return {ErrorCode::kUnreachable, what + " on DDS domain " + std::to_string(options_.domain) + " at " +
                                         options_.interface_address + " failed"};
  }

  const DdsLinkOptions options_;
  const Authorship authorship_;
  JoinWatch joins_;
  bool told_of_impostor_ = false;
  Bell bell_;
  dds::DomainParticipant* participant_ = nullptr;
  dds::Subscriber* subscriber_ = nullptr;
  dds::Subscriber* own_subscriber_ = nullptr;  // of an observer with a name, for what goes to it alone
  std::map<Topic, dds::Topic*> topics_;
  std::map<std::string, dds::Publisher*> publishers_;                               // by partition
  std::map<std::pair<Topic, std::string>, std::vector<dds::DataWriter*>> writers_;  // by topic and partition
  std::map<Topic, std::unique_ptr<Inlet>> inlets_;
  std::unique_ptr<RoundTrips> round_trips_;  // where a link can be slow
  std::unique_ptr<DiscoveryClient> discovery_;
};

DdsLink::~DdsLink() {
  discovery_.reset();  // before DDS says good-bye, which newcomers must not be told as an announcement
  if (participant_ == nullptr) return;
  round_trips_.reset();
  participant_->set_listener(nullptr);
  // Listeners first: after this no callback runs into members that go.
  for (auto& [topic, inlet] : inlets_) {
    if (inlet->reader() != nullptr) inlet->reader()->set_listener(nullptr);
  }
  participant_->delete_contained_entities();
  dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
}

// Fast DDS hands samples straight to readers of its own process, and never offers them again to one that was full.
void switchOffShortCuts() {
  static const bool done = [] {
    eprosima::fastrtps::LibrarySettingsAttributes settings;
    settings.intraprocess_delivery = eprosima::fastrtps::INTRAPROCESS_OFF;
    eprosima::fastrtps::xmlparser::XMLProfileManager::library_settings(settings);
    return true;
  }();
  static_cast<void>(done);
}

Result<void> DdsLink::open() {
  switchOffShortCuts();
  if (profileOf(options_) != "local") round_trips_ = std::make_unique<RoundTrips>();
  const std::string name = "comap/" + roleName(options_.role) + (options_.robot.empty() ? "" : "/" + options_.robot);
  if (auto asked = askServer(); !asked) return asked;
  const HandshakeRoom room(options_);
  participant_ = dds::DomainParticipantFactory::get_instance()->create_participant(
      static_cast<uint32_t>(options_.domain),
      participantQos(name, options_, discovery_ ? discovery_->port() : uint16_t{0}), &joins_, dds::StatusMask::none());
  if (participant_ == nullptr) {
    return unreachable(options_.keys.empty() ? "joining (are its ports taken?)"
                                             : "joining with link.keys '" + options_.keys +
                                                   "' (are its ports taken? 'fleet keys show' checks the keys)");
  }
  if (discovery_) {
    ParticipantPrefix prefix{};
    std::copy_n(std::begin(participant_->guid().guidPrefix.value), prefix.size(), prefix.begin());
    discovery_->follow(prefix);
  }
  const dds::TypeSupport type(new OctetsType);
  if (participant_->register_type(type) != ReturnCode_t::RETCODE_OK) return unreachable("registering the type");
  if (auto made = openSubscriber(partitionsRead(options_.role, options_.site, options_.robot), subscriber_); !made)
    return made;
  // Tiles for others must not come to an observer: their writers would wait for it too.
  const bool asks = options_.role == LinkRole::kObserver && !options_.robot.empty();
  if (auto made =
          asks ? openSubscriber({partitionWritten(options_.site, options_.robot)}, own_subscriber_) : Result<void>();
      !made)
    return made;
  for (const Topic topic : kAllTopics) {
    const bool in = reads(options_.role, topic), out = writes(options_.role, topic);
    if (!in && !out) continue;
    if (options_.role == LinkRole::kObserver && options_.robot.empty() && isForNamedObservers(topic)) continue;
    topics_[topic] = participant_->create_topic(topicName(topic), type.get_type_name(), dds::TOPIC_QOS_DEFAULT);
    if (topics_[topic] == nullptr) return unreachable("creating topic " + topicName(topic));
    if (auto opened = in ? openReader(topic) : Result<void>(); !opened) return opened;
    // A core's writers to a robot are made when it has something to say to it.
    if (!out || (options_.role == LinkRole::kCore && isToRobots(topic))) continue;
    if (auto writer = writerOf(topic, options_.robot); !writer) return writer.error();
  }
  return {};
}

Result<void> DdsLink::askServer() {
  if (options_.discovery_server.empty()) return {};
  const MemberRole role = options_.role == LinkRole::kRobot  ? MemberRole::kRobot
                          : options_.role == LinkRole::kCore ? MemberRole::kCore
                                                             : MemberRole::kObserver;
  auto client = DiscoveryClient::start(
      {options_.discovery_server, options_.interface_address, options_.domain, options_.site, role, options_.notice});
  if (!client) return client.error();
  discovery_ = std::move(*client);
  return {};
}

Result<void> DdsLink::openSubscriber(const std::vector<std::string>& partitions, dds::Subscriber*& subscriber) {
  dds::SubscriberQos qos = dds::SUBSCRIBER_QOS_DEFAULT;
  for (const std::string& partition : partitions) qos.partition().push_back(partition.c_str());
  subscriber = participant_->create_subscriber(qos);
  return subscriber != nullptr ? Result<void>() : unreachable("creating the subscriber");
}

Result<dds::Publisher*> DdsLink::publisherTo(const std::string& partition) {
  if (const auto it = publishers_.find(partition); it != publishers_.end()) return it->second;
  if (publishers_.size() >= kMaxRobots) dropAbsent();
  if (publishers_.size() >= kMaxRobots)
    return Error{ErrorCode::kProblem, "more than " + std::to_string(kMaxRobots) + " robots on one link"};
  dds::PublisherQos qos = dds::PUBLISHER_QOS_DEFAULT;
  qos.partition().push_back(partition.c_str());
  dds::Publisher* publisher = participant_->create_publisher(qos);
  if (publisher == nullptr) return unreachable("creating the publisher of partition " + partition);
  return publishers_[partition] = publisher;
}

// Only when names run out: who is away for a moment finds what waits for it.
void DdsLink::dropAbsent() {
  for (auto it = publishers_.begin(); it != publishers_.end();) {
    const bool there = std::any_of(writers_.begin(), writers_.end(), [&](const auto& entry) {
      return entry.first.second == it->first && std::any_of(entry.second.begin(), entry.second.end(),
                                                            [&](auto* writer) { return readersOf(*writer) > 0; });
    });
    const bool dropped = !there && dropWriters(it->first, *it->second) &&
                         participant_->delete_publisher(it->second) == ReturnCode_t::RETCODE_OK;
    it = dropped ? publishers_.erase(it) : std::next(it);
  }
}

bool DdsLink::dropWriters(const std::string& partition, dds::Publisher& publisher) {
  if (round_trips_) round_trips_->forget(partition);
  for (auto it = writers_.begin(); it != writers_.end();) {
    if (it->first.second != partition) {
      ++it;
      continue;
    }
    auto& writers = it->second;
    while (!writers.empty()) {
      if (publisher.delete_datawriter(writers.back()) != ReturnCode_t::RETCODE_OK) return false;
      writers.pop_back();
    }
    it = writers_.erase(it);
  }
  return true;
}

// Of topics that are paced there is a writer for each period, opened together so that each has found its reader when
// its time comes.
Result<dds::DataWriter*> DdsLink::writerOf(Topic topic, const std::string& robot) {
  const std::string partition = partitionWritten(options_.site, robot);
  const bool paced = round_trips_ && isPaced(topic);
  auto& writers = writers_[{topic, partition}];
  for (size_t i = writers.size(); i < (paced ? RepairPace::kPeriods.size() : 1); ++i) {
    const auto publisher = publisherTo(partition);
    if (!publisher) return publisher.error();
    dds::DataWriterQos qos = writerQos(topic, options_.max_blocking_ms);
    if (paced) {
      const auto period_ms = RepairPace::kPeriods[i].count();
      qos.reliable_writer_qos().times.heartbeatPeriod = {static_cast<int32_t>(period_ms / 1000),
                                                         static_cast<uint32_t>(period_ms % 1000 * 1'000'000)};
      // A full writer would add a heartbeat to each datagram, which is answered by a request for all that is missing.
      qos.reliable_writer_qos().disable_heartbeat_piggyback = true;
    }
    dds::DataWriter* writer = (*publisher)->create_datawriter(topics_.at(topic), qos);
    if (writer == nullptr) return unreachable("creating the writer of " + topicName(topic));
    writers.push_back(writer);
  }
  return writers[paced ? round_trips_->choice(partition) : 0];
}

Result<void> DdsLink::openReader(Topic topic) {
  const bool own_tiles = options_.role == LinkRole::kObserver && isForNamedObservers(topic);
  auto& inlet = inlets_[topic] = std::make_unique<Inlet>(
      topic, options_.role == LinkRole::kRobot || own_tiles ? options_.robot : "", bell_,
      [this, topic](const Octets& sample, const dds::SampleInfo& info) { return isGenuine(topic, sample, info); });
  // Created without listener: the first callback may come before create_datareader has returned.
  inlet->setReader((own_tiles ? own_subscriber_ : subscriber_)->create_datareader(topics_.at(topic), readerQos(topic)));
  if (inlet->reader() == nullptr) return unreachable("creating the reader of " + topicName(topic));
  inlet->reader()->set_listener(inlet.get(), dds::StatusMask::data_available());
  return {};
}

Result<void> DdsLink::publish(Topic topic, const std::string& robot, std::span<const uint8_t> payload) {
  if (auto allowed = checkPublish(options_.role, options_.robot, topic, robot, payload.size()); !allowed) {
    return allowed;
  }
  // All writers to a robot at once, so that tiles find their reader when their time comes.
  for (const Topic other : kAllTopics) {
    if (options_.role != LinkRole::kCore || !isToRobots(topic) || !isToRobots(other)) continue;
    if (const auto opened = writerOf(other, robot); !opened) return opened.error();
  }
  const auto writer = writerOf(topic, robot);
  if (!writer) return writer.error();
  if (topic == Topic::kTile && readersOf(**writer) == 0)
    return Error{ErrorCode::kUnreachable, topicName(topic) + ": robot '" + robot + "' is not there"};
  Octets octets{robot, {payload.begin(), payload.end()}};
  const ReturnCode_t code = (*writer)->write(&octets, dds::HANDLE_NIL);
  if (code == ReturnCode_t::RETCODE_OK) {
    if (round_trips_ && measuresPace(topic)) round_trips_->sent(partitionWritten(options_.site, robot), *writer);
    return {};
  }
  const std::string what = topicName(topic) + ": " + std::to_string(payload.size()) + " bytes ";
  if (code == ReturnCode_t::RETCODE_TIMEOUT) {
    return Error{ErrorCode::kUnreachable, what + "not taken within " +
                                              std::to_string(maxBlocking_ms(topic, options_.max_blocking_ms)) +
                                              " ms by " + std::to_string(readersOf(**writer)) + " readers"};
  }
  return Error{ErrorCode::kUnreachable, what + "refused by DDS with code " + std::to_string(code())};
}

// What a core writes, only a core has leave to; what a robot writes, each robot has, but in its own name alone.
bool DdsLink::isGenuine(Topic topic, const Octets& sample, const dds::SampleInfo& info) {
  if (!writes(LinkRole::kRobot, topic)) return true;
  const auto writer = eprosima::fastrtps::rtps::iHandle2GUID(info.publication_handle);
  if (authorship_.isOf(writer.guidPrefix, KeyRole::kRobot, sample.robot)) return true;
  if (writes(LinkRole::kObserver, topic) && authorship_.isOf(writer.guidPrefix, KeyRole::kTool, sample.robot))
    return true;
  if (!told_of_impostor_ && options_.notice) {
    options_.notice(topicName(topic) + " in the name of robot '" + safeName(sample.robot) +
                    "' from a participant whose certificate is not that robot's: passed over");
  }
  told_of_impostor_ = true;
  return false;
}

bool DdsLink::delivered(Topic topic, const std::string& robot) const {
  const auto it = writers_.find({topic, partitionWritten(options_.site, robot)});
  return it == writers_.end() || std::all_of(it->second.begin(), it->second.end(), [](dds::DataWriter* writer) {
           return writer->wait_for_acknowledgments({0, 0}) == ReturnCode_t::RETCODE_OK;
         });
}

Inlet* DdsLink::oldestHead() {
  Inlet* oldest = nullptr;
  for (auto& [topic, inlet] : inlets_) {
    inlet->fill();
    if (inlet->hasHead() && (oldest == nullptr || inlet->headTime() < oldest->headTime())) oldest = inlet.get();
  }
  return oldest;
}

std::optional<Delivery> DdsLink::receive(std::chrono::milliseconds timeout) {
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  while (true) {
    const uint64_t seen = bell_.rings();
    if (Inlet* inlet = oldestHead(); inlet != nullptr) return inlet->takeHead();
    if (std::chrono::steady_clock::now() >= deadline) return std::nullopt;
    bell_.waitBeyond(seen, deadline);
  }
}

int DdsLink::readersOf(const dds::DataWriter& writer) const {
  dds::PublicationMatchedStatus status;
  const_cast<dds::DataWriter&>(writer).get_publication_matched_status(status);
  return status.current_count;
}

int DdsLink::writersOf(Topic topic) const {
  dds::SubscriptionMatchedStatus status;
  inlets_.at(topic)->reader()->get_subscription_matched_status(status);
  return status.current_count;
}

int DdsLink::peers() const {
  // A peer counts once every topic that always joins the two is matched. Topics of observers would only add to a
  // count, and a core opens those to a robot when it has heard of it.
  int count = std::numeric_limits<int>::max();
  if (options_.role == LinkRole::kRobot) {
    for (const auto& [topic, writers] : writers_)
      for (const dds::DataWriter* writer : writers) count = std::min(count, readersOf(*writer));
  }
  for (const auto& [topic, inlet] : inlets_) {
    const bool from_peer = options_.role == LinkRole::kCore || (options_.role == LinkRole::kObserver &&
                                                                writes(LinkRole::kCore, topic) && !isToRobots(topic));
    if (from_peer) count = std::min(count, writersOf(topic));
  }
  return count;
}

bool isAddress(const std::string& text) {
  in_addr address{};
  return inet_pton(AF_INET, text.c_str(), &address) == 1;
}

Result<void> checkProfile(const DdsLinkOptions& options) {
  const std::string profile = profileOf(options);
  if (profile != "local" && profile != "lan" && profile != "wan")
    return Error{ErrorCode::kWrongUse, "link.profile '" + profile + "', expected auto, local, lan or wan"};
  if (profile == "local" && !options.interface_address.starts_with("127."))
    return Error{ErrorCode::kWrongUse, "link.profile local stays on this machine, but link.interface_address is '" +
                                           options.interface_address + "': expected 127.0.0.1, or profile lan or wan"};
  if (!options.core_address.empty() && !isAddress(options.core_address))
    return Error{ErrorCode::kWrongUse, "link.core_address '" + options.core_address + "' is no IPv4 address"};
  if (!options.discovery_server.empty())
    if (auto parsed = parseHostPort(options.discovery_server, "link.discovery_server"); !parsed) return parsed.error();
  if (profile == "wan" && options.role != LinkRole::kCore && options.core_address.empty() &&
      options.discovery_server.empty())
    return Error{ErrorCode::kWrongUse,
                 "link.profile wan has no multicast: link.core_address must name the core, or link.discovery_server a "
                 "discovery server"};
  return {};
}

Result<std::unique_ptr<Link>> openOn(DdsLinkOptions options, const std::string& address) {
  options.interface_address = address;
  auto link = std::make_unique<DdsLink>(options);
  if (auto opened = link->open(); !opened) return opened.error();
  return std::unique_ptr<Link>(std::move(link));
}

}  // namespace

Result<void> checkDdsOptions(const DdsLinkOptions& options) {
  if (options.domain < 0 || options.domain > kMaxDomain) {
    return Error{ErrorCode::kWrongUse,
                 "link.domain is " + std::to_string(options.domain) + ", expected 0 to " + std::to_string(kMaxDomain)};
  }
  if (options.site.empty() || options.site.size() > 64 || options.site.find_first_of("*?[]\\/") != std::string::npos) {
    return Error{ErrorCode::kWrongUse, "link.site '" + options.site.substr(0, 64) +
                                           "' is no site, expected 1-64 characters without * ? [ ] \\ /"};
  }
  if (options.role == LinkRole::kRobot || (options.role == LinkRole::kObserver && !options.robot.empty())) {
    if (const std::string problem = robotNameProblem(options.robot); !problem.empty()) {
      return Error{ErrorCode::kWrongUse, problem};
    }
  }
  if (auto checked = checkProfile(options); !checked) return checked.error();
  const bool by_name = if_nametoindex(options.interface_address.c_str()) != 0;
  if (!by_name && ownAddress(options.interface_address).empty()) {
    return Error{ErrorCode::kUnreachable, "link.interface_address '" + options.interface_address +
                                              "' is no IPv4 address or network interface of this machine that is up"};
  }
  if (options.keys.empty() && !options.insecure && options.interface_address.rfind("127.", 0) != 0)
    return Error{ErrorCode::kWrongUse,
                 "link.interface_address '" + options.interface_address +
                     "' leaves this machine and messages are not encrypted: make keys with 'fleet keys' and give them "
                     "with --keys or link.keys; or, if that network is trusted, say so with --insecure or "
                     "link.insecure: true"};
  return checkKeys(options);
}

Result<std::unique_ptr<Link>> connectDds(const DdsLinkOptions& options) {
  if (auto checked = checkDdsOptions(options); !checked) return checked.error();
  const bool by_name = if_nametoindex(options.interface_address.c_str()) != 0;
  if (!by_name && options.keys.empty()) return openOn(options, options.interface_address);
  const auto addressNow = [by_name, interface = options.interface_address] {
    return by_name ? ownAddress(interface) : interface;
  };
  std::optional<Revocations> revocations;
  const auto silence = [](const std::string&) {};
  if (!options.keys.empty()) revocations.emplace(options.keys, options.notice ? options.notice : silence);
  auto roaming = std::make_unique<RoamingLink>(
      options.interface_address, addressNow, [options](const std::string& address) { return openOn(options, address); },
      std::move(revocations));
  if (auto opened = roaming->follow(); !opened) return opened.error();
  return std::unique_ptr<Link>(std::move(roaming));
}

}  // namespace comap
