#include "protocol/link/dds_link.h"

#include <fastrtps/xmlparser/XMLProfileManager.h>
#include <net/if.h>

#include <algorithm>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <limits>
#include <map>
#include <vector>

#include "protocol/discovery/discovery_client.h"
#include "protocol/link/bell.h"
#include "protocol/link/bounded_link.h"
#include "protocol/link/core_watch.h"
#include "protocol/link/inlet.h"
#include "protocol/link/octets_type.h"
#include "protocol/link/outlets.h"
#include "protocol/link/qos.h"
#include "protocol/link/roaming_link.h"
#include "protocol/link/security.h"
#include "protocol/link/topics.h"

namespace comap {
namespace {

namespace dds = eprosima::fastdds::dds;
using eprosima::fastrtps::types::ReturnCode_t;

constexpr std::chrono::seconds kClosing{30};   // far longer than it takes
constexpr std::chrono::seconds kHandshake{3};  // longer than it takes

class DdsLink : public Link {
 public:
  explicit DdsLink(DdsLinkOptions options)
      : options_(std::move(options)),
        authorship_(options_),
        watch_(options_),
        rank_{false, options_.began},
        outlets_(options_, topics_) {}
  ~DdsLink() override;
  Result<void> open();

  Result<void> publish(Topic topic, const std::string& robot, std::span<const uint8_t> payload) override;
  bool delivered(Topic topic, const std::string& robot) const override { return outlets_.delivered(topic, robot); }
  std::optional<Delivery> receive(std::chrono::milliseconds timeout) override;
  int peers() const override;
  std::string trouble() const override;
  std::string elder() const override { return rank_.began.empty() ? std::string() : watch_.elder(rank_); }
  bool knowsCores() const override { return watch_.knowsAll(); }
  void serve() override;

 private:
  Result<void> askServer();
  Result<void> openSubscriber(const std::vector<std::string>& partitions, dds::Subscriber*& subscriber);
  Result<void> openReader(Topic topic);
  Result<void> watchCores();
  bool isGenuine(Topic topic, const Octets& sample, const dds::SampleInfo& info);
  Inlet* oldestHead();
  int writersOf(Topic topic) const;
  std::string keptOut(std::chrono::seconds at_least) const;
  void tellIfKeptOut();

  const DdsLinkOptions options_;
  const Authorship authorship_;
  CoreWatch watch_;
  CoreRank rank_;  // of a core
  bool told_of_impostor_ = false, told_kept_out_ = false;
  std::chrono::steady_clock::time_point looked_{};  // whether we are kept out
  Bell bell_;
  dds::DomainParticipant* participant_ = nullptr;
  dds::Subscriber* subscriber_ = nullptr;
  dds::Subscriber* own_subscriber_ = nullptr;  // of an observer with a name, for what goes to it alone
  dds::DataReader* core_reader_ = nullptr;     // of a core, of what cores write; nothing is taken from it
  Outlets::Topics topics_;
  Outlets outlets_;
  std::map<Topic, std::unique_ptr<Inlet>> inlets_;
  std::unique_ptr<DiscoveryClient> discovery_;
};

DdsLink::~DdsLink() {
  discovery_.reset();  // before DDS says good-bye, which newcomers must not be told as an announcement
  if (participant_ == nullptr) return;
  outlets_.leave();
  participant_->set_listener(nullptr);
  // Listeners first: after this no callback runs into members that go.
  for (auto& [topic, inlet] : inlets_) {
    if (inlet->reader() != nullptr) inlet->reader()->set_listener(nullptr);
  }
  if (core_reader_ != nullptr) core_reader_->set_listener(nullptr);
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
  const std::string name = "comap/" + roleName(options_.role) + (options_.robot.empty() ? "" : "/" + options_.robot);
  if (auto asked = askServer(); !asked) return asked;
  const HandshakeRoom room(options_);
  participant_ = dds::DomainParticipantFactory::get_instance()->create_participant(
      static_cast<uint32_t>(options_.domain),
      participantQos(name, options_, discovery_ ? discovery_->port() : uint16_t{0}), &watch_, dds::StatusMask::none());
  if (participant_ == nullptr) {
    return unreachable(options_, options_.keys.empty()
                                     ? "joining (are its ports taken?)"
                                     : "joining with link.keys '" + options_.keys +
                                           "' (are its ports taken? 'fleet keys show' checks the keys)");
  }
  outlets_.join(*participant_);
  if (discovery_) {
    ParticipantPrefix prefix{};
    std::copy_n(std::begin(participant_->guid().guidPrefix.value), prefix.size(), prefix.begin());
    discovery_->follow(prefix);
  }
  const dds::TypeSupport type(new OctetsType);
  if (participant_->register_type(type) != ReturnCode_t::RETCODE_OK)
    return unreachable(options_, "registering the type");
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
    if (topics_[topic] == nullptr) return unreachable(options_, "creating topic " + topicName(topic));
    if (auto opened = in ? openReader(topic) : Result<void>(); !opened) return opened;
    if (topic == Topic::kCoreStatus && !rank_.began.empty()) outlets_.announce(topic, textOf(rank_));
    // A core's writers to a robot are made when it has something to say to it.
    if (!out || (options_.role == LinkRole::kCore && isToRobots(topic))) continue;
    if (auto opened = outlets_.open(topic, options_.robot); !opened) return opened;
  }
  return options_.role == LinkRole::kCore ? watchCores() : Result<void>();
}

Result<void> DdsLink::watchCores() {
  dds::Subscriber* subscriber = nullptr;
  if (auto made = openSubscriber({partitionWritten(options_.site, "")}, subscriber); !made) return made;
  const Topic topic = Topic::kCoreStatus;
  core_reader_ = subscriber->create_datareader(topics_.at(topic), readerQos(topic), &watch_,
                                               dds::StatusMask::subscription_matched());
  return core_reader_ != nullptr ? Result<void>() : unreachable(options_, "creating the reader of " + topicName(topic));
}

void DdsLink::serve() {
  rank_.serves = true;
  outlets_.announce(Topic::kCoreStatus, textOf(rank_));
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
  return subscriber != nullptr ? Result<void>() : unreachable(options_, "creating the subscriber");
}

Result<void> DdsLink::openReader(Topic topic) {
  const bool own_tiles = options_.role == LinkRole::kObserver && isForNamedObservers(topic);
  auto& inlet = inlets_[topic] = std::make_unique<Inlet>(
      topic, options_.role == LinkRole::kRobot || own_tiles ? options_.robot : "", bell_,
      [this, topic](const Octets& sample, const dds::SampleInfo& info) { return isGenuine(topic, sample, info); });
  // Created without listener: the first callback may come before create_datareader has returned.
  inlet->setReader((own_tiles ? own_subscriber_ : subscriber_)->create_datareader(topics_.at(topic), readerQos(topic)));
  if (inlet->reader() == nullptr) return unreachable(options_, "creating the reader of " + topicName(topic));
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
    if (auto opened = outlets_.open(other, robot); !opened) return opened;
  }
  return outlets_.write(topic, robot, payload);
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

Inlet* DdsLink::oldestHead() {
  Inlet* oldest = nullptr;
  for (auto& [topic, inlet] : inlets_) {
    inlet->fill();
    if (inlet->hasHead() && (oldest == nullptr || inlet->headTime() < oldest->headTime())) oldest = inlet.get();
  }
  return oldest;
}

std::optional<Delivery> DdsLink::receive(std::chrono::milliseconds timeout) {
  tellIfKeptOut();
  const auto deadline = std::chrono::steady_clock::now() + timeout;
  while (true) {
    const uint64_t seen = bell_.rings();
    if (Inlet* inlet = oldestHead(); inlet != nullptr) return inlet->takeHead();
    if (std::chrono::steady_clock::now() >= deadline) return std::nullopt;
    bell_.waitBeyond(seen, deadline);
  }
}

int DdsLink::writersOf(Topic topic) const {
  dds::SubscriptionMatchedStatus status;
  inlets_.at(topic)->reader()->get_subscription_matched_status(status);
  return status.current_count;
}

int DdsLink::peers() const {
  // A peer counts once every topic that always joins the two is matched. Topics of observers would only add to a
  // count, and a core opens those to a robot when it has heard of it.
  int count = options_.role == LinkRole::kRobot ? outlets_.fewestReaders() : std::numeric_limits<int>::max();
  for (const auto& [topic, inlet] : inlets_) {
    const bool from_peer = options_.role == LinkRole::kCore || (options_.role == LinkRole::kObserver &&
                                                                writes(LinkRole::kCore, topic) && !isToRobots(topic));
    if (from_peer) count = std::min(count, writersOf(topic));
  }
  return count;
}

std::string DdsLink::trouble() const {
  const std::string undiscovered = discovery_ ? discovery_->trouble() : std::string();
  return undiscovered.empty() ? keptOut(kHandshake) : undiscovered;
}

// Who is not let in is not told so by DDS, nor why: revoked keys are known to those who have the new list alone.
std::string DdsLink::keptOut(std::chrono::seconds at_least) const {
  const auto in_sight = options_.keys.empty() ? std::nullopt : watch_.coreInSight();
  if (!in_sight || *in_sight < at_least || peers() > 0) return {};
  return "the site's core is in sight and does not let this " + roleName(options_.role) +
         " in: ask the fleet's operator whether its keys ('" + options_.keys +
         "') were revoked, and whether the clock of this machine is right";
}

void DdsLink::tellIfKeptOut() {
  constexpr std::chrono::seconds kLookEvery(1);
  const auto now = std::chrono::steady_clock::now();
  if (told_kept_out_ || !options_.notice || options_.role == LinkRole::kCore || now - looked_ < kLookEvery) return;
  looked_ = now;
  const std::string text = keptOut(5 * kHandshake);
  told_kept_out_ = !text.empty();
  if (told_kept_out_) options_.notice(text);
}

Result<std::unique_ptr<Link>> openOn(DdsLinkOptions options, const std::string& address) {
  options.interface_address = address;
  auto link = std::make_shared<DdsLink>(options);
  if (auto opened = link->open(); !opened) return opened.error();
  return std::unique_ptr<Link>(std::make_unique<BoundedLink>(std::move(link), kClosing, options.notice));
}

}  // namespace

Result<std::unique_ptr<Link>> connectDds(const DdsLinkOptions& given) {
  if (auto checked = checkDdsOptions(given); !checked) return checked.error();
  DdsLinkOptions options = given;
  if (options.role == LinkRole::kCore && options.began.empty()) options.began = newCoreRank().began;
  const bool by_name = if_nametoindex(options.interface_address.c_str()) != 0;
  if (!by_name && options.keys.empty()) return openOn(options, options.interface_address);
  const auto addressNow = [by_name, interface = options.interface_address] {
    return by_name ? ownAddress(interface) : interface;
  };
  std::optional<Revocations> revocations;
  const auto silence = [](const std::string&) {};
  if (!options.keys.empty()) revocations.emplace(options.keys, options.notice ? options.notice : silence);
  auto roaming = std::make_unique<RoamingLink>(
      options.interface_address, addressNow,
      [options](const std::string& address, const std::string& revoked) {
        DdsLinkOptions now = options;
        now.revoked = revoked;
        return openOn(now, address);
      },
      std::move(revocations));
  if (auto opened = roaming->follow(); !opened) return opened.error();
  return std::unique_ptr<Link>(std::move(roaming));
}

}  // namespace comap
