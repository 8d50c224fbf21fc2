// Keys on the wire, with real participants: who may join, what each may do, and what is said when it may not.
#include "protocol/link/security.h"

#include <fastrtps/config.h>
#include <gmock/gmock.h>
#include <ifaddrs.h>
#include <net/if.h>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fstream>
#include <map>
#include <mutex>
#include <sstream>
#include <thread>

#include "protocol/keys/signed_text.h"
#include "protocol/link/octets_type.h"
#include "protocol/link/qos.h"
#include "protocol/link/topics.h"
#include "tests/protocol/link/site_keys.h"

namespace comap {
namespace {

namespace dds = eprosima::fastdds::dds;
namespace fs = std::filesystem;
using namespace std::chrono_literals;
using testing::AllOf;
using testing::HasSubstr;

constexpr const char* kSite = "keyed";

int testDomain() { return 100 + getpid() % 121; }

// What a link told while it was open.
class Notices {
 public:
  std::function<void(const std::string&)> sink() {
    return [this](const std::string& text) {
      const std::lock_guard lock(mutex_);
      text_ += text + "\n";
    };
  }
  std::string text() const {
    const std::lock_guard lock(mutex_);
    return text_;
  }
  bool awaits(const std::string& part) const {
    for (int i = 0; i < 3000 && text().find(part) == std::string::npos; ++i) std::this_thread::sleep_for(5ms);
    return text().find(part) != std::string::npos;
  }

 private:
  mutable std::mutex mutex_;
  std::string text_;
};

DdsLinkOptions optionsOf(LinkRole role, const std::string& robot, const std::string& keys) {
  DdsLinkOptions options{testDomain(), kSite, role, robot, "127.0.0.1"};
  options.keys = keys;
  return options;
}

std::unique_ptr<Link> open(const DdsLinkOptions& options) {
  auto link = connectDds(options);
  if (!link) ADD_FAILURE() << link.error().text;
  return link ? std::move(*link) : nullptr;
}

bool waitForPeers(const Link& link, int count, std::chrono::milliseconds limit = 20s) {
  for (auto waited = 0ms; waited < limit && link.peers() != count; waited += 5ms) std::this_thread::sleep_for(5ms);
  return link.peers() == count;
}

std::string contentOf(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

void overwrite(const std::string& path, const std::string& content) {
  std::ofstream(path, std::ios::binary | std::ios::trunc) << content;
}

void replaceIn(const std::string& path, const std::string& from, const std::string& to) {
  std::string text = contentOf(path);
  const size_t at = text.find(from);
  ASSERT_NE(at, std::string::npos) << path;
  overwrite(path, text.replace(at, from.size(), to));
}

// --- Refused before anything is sent, in a sentence that says what to check.

class RefusedKeys : public testing::Test {
 protected:
  // Robot a's keys after `damage` to its folder.
  void expectRefusal(const std::function<void(const std::string& folder)>& damage, ErrorCode code,
                     const testing::Matcher<std::string>& text) {
    const std::string folder = keys_.of(KeyRole::kRobot, "a");
    damage(folder);
    const auto link = connectDds(optionsOf(LinkRole::kRobot, "a", folder));
    ASSERT_FALSE(link);
    EXPECT_EQ(link.error().code, code) << link.error().text;
    EXPECT_THAT(link.error().text, text);
  }

  SiteKeys keys_{kSite};
};

TEST_F(RefusedKeys, NoSuchFolder) {
  expectRefusal([](const std::string& folder) { fs::remove_all(folder); }, ErrorCode::kUnreachable,
                HasSubstr("'fleet keys'"));
}

TEST_F(RefusedKeys, AFileIsMissing) {
  for (const char* name :
       {"authority.pem", "certificate.pem", "key.pem", "governance.p7s", "permissions.p7s", "revoked.pem"}) {
    const std::string folder = keys_.of(KeyRole::kRobot, "a");
    expectRefusal([&](const std::string&) { fs::remove(folder + "/" + name); }, ErrorCode::kUnreachable,
                  AllOf(HasSubstr(folder + "/" + name), HasSubstr("No such file")));
    fs::remove_all(folder);
  }
}

TEST_F(RefusedKeys, AFileIsNone) {
  for (const char* name :
       {"authority.pem", "certificate.pem", "key.pem", "governance.p7s", "permissions.p7s", "revoked.pem"}) {
    const std::string folder = keys_.of(KeyRole::kRobot, "a");
    expectRefusal([&](const std::string&) { overwrite(folder + "/" + name, "once upon a time"); }, ErrorCode::kBadData,
                  HasSubstr(folder + "/" + name + ": "));
    fs::remove_all(folder);
  }
}

TEST_F(RefusedKeys, TheKeyIsOpenToOthers) {
  expectRefusal([](const std::string& folder) { fs::permissions(folder + "/key.pem", fs::perms(0640)); },
                ErrorCode::kBadData, AllOf(HasSubstr("key.pem"), HasSubstr("chmod 600")));
}

TEST_F(RefusedKeys, TheKeyIsAnothers) {
  const std::string other = keys_.of(KeyRole::kRobot, "b");
  expectRefusal([&](const std::string& folder) { overwrite(folder + "/key.pem", contentOf(other + "/key.pem")); },
                ErrorCode::kBadData, HasSubstr("key.pem: not the key of"));
}

TEST_F(RefusedKeys, TheCertificateIsOfAnotherAuthority) {
  SiteKeys other(kSite);
  const std::string stranger = other.of(KeyRole::kRobot, "a");
  expectRefusal(
      [&](const std::string& folder) {
        overwrite(folder + "/certificate.pem", contentOf(stranger + "/certificate.pem"));
        overwrite(folder + "/key.pem", contentOf(stranger + "/key.pem"));
      },
      ErrorCode::kBadData, AllOf(HasSubstr("certificate.pem: the authority in"), HasSubstr("did not sign it")));
}

TEST_F(RefusedKeys, PermissionsWereEdited) {
  expectRefusal(
      [](const std::string& folder) { replaceIn(folder + "/permissions.p7s", "comap/v1/hello", "comap/v1/tiles"); },
      ErrorCode::kBadData,
      AllOf(HasSubstr("permissions.p7s: is not as the authority signed it"), HasSubstr("changed")));
}

TEST_F(RefusedKeys, GovernanceWasEdited) {
  expectRefusal([](const std::string& folder) { replaceIn(folder + "/governance.p7s", "ENCRYPT", "NONE"); },
                ErrorCode::kBadData, HasSubstr("governance.p7s: is not as the authority signed it"));
}

// The robot's certificate comes from the authority too: it must not be able to sign its own permissions.
TEST_F(RefusedKeys, PermissionsThatTheRobotSignedItself) {
  expectRefusal(
      [](const std::string& folder) {
        const auto permissions =
            verifySignedText(contentOf(folder + "/permissions.p7s"), contentOf(folder + "/authority.pem"), "p");
        ASSERT_TRUE(permissions);
        const auto own = signText(*permissions, contentOf(folder + "/certificate.pem"), contentOf(folder + "/key.pem"));
        ASSERT_TRUE(own) << own.error().text;
        overwrite(folder + "/permissions.p7s", *own);
      },
      ErrorCode::kBadData, HasSubstr("permissions.p7s: is not as the authority signed it"));
}

TEST_F(RefusedKeys, PermissionsOfAnotherRobot) {
  const std::string other = keys_.of(KeyRole::kRobot, "b");
  expectRefusal(
      [&](const std::string& folder) { overwrite(folder + "/permissions.p7s", contentOf(other + "/permissions.p7s")); },
      ErrorCode::kBadData, HasSubstr("permissions.p7s: grants nothing to robot 'a' of site 'keyed'"));
}

TEST_F(RefusedKeys, ExpiredNotYetValidAndRevoked) {
  keys_.of(KeyRole::kRobot, "a", validDays(-20, -10));
  expectRefusal([](const std::string&) {}, ErrorCode::kBadData,
                AllOf(HasSubstr("certificate.pem: expired on 20"), HasSubstr("'fleet keys'")));
  fs::remove_all(keys_.path() + "/a");
  keys_.of(KeyRole::kRobot, "a", validDays(10, 20));
  expectRefusal([](const std::string&) {}, ErrorCode::kBadData,
                AllOf(HasSubstr("certificate.pem: not valid before 20"), HasSubstr("clock")));
  fs::remove_all(keys_.path() + "/a");
  keys_.of(KeyRole::kRobot, "a");
  ASSERT_TRUE(revokeParticipant(keys_.path(), "a"));
  for (const auto& entry : fs::directory_iterator(keys_.path() + "/revoked"))
    fs::rename(entry.path(), keys_.path() + "/a");
  expectRefusal([](const std::string&) {}, ErrorCode::kBadData, HasSubstr("certificate.pem: revoked"));
}

TEST_F(RefusedKeys, OfAnotherRoleRobotOrSite) {
  const std::string robot = keys_.of(KeyRole::kRobot, "a"), core = keys_.of(KeyRole::kCore, "core");
  const auto refusal = [](const DdsLinkOptions& options) {
    const auto link = connectDds(options);
    EXPECT_FALSE(link);
    return link ? std::string() : link.error().text;
  };
  EXPECT_THAT(refusal(optionsOf(LinkRole::kCore, "", robot)),
              HasSubstr("is of robot 'a' of site 'keyed', this is a core"));
  EXPECT_THAT(refusal(optionsOf(LinkRole::kRobot, "a", core)), HasSubstr("is of core 'core' of site 'keyed'"));
  EXPECT_THAT(refusal(optionsOf(LinkRole::kRobot, "b", robot)), HasSubstr("this robot is 'b'"));
  EXPECT_THAT(refusal(optionsOf(LinkRole::kObserver, "", robot)), HasSubstr("this is a tool"));
  DdsLinkOptions elsewhere = optionsOf(LinkRole::kRobot, "a", robot);
  elsewhere.site = "other";
  EXPECT_THAT(refusal(elsewhere), HasSubstr("but link.site is 'other'"));
}

// --- Refused by the peers.

class KeyedPeers : public testing::Test {
 protected:
  DdsLinkOptions core() { return optionsOf(LinkRole::kCore, "", keys_.of(KeyRole::kCore, "core")); }
  DdsLinkOptions robot(const std::string& name) {
    return optionsOf(LinkRole::kRobot, name, keys_.of(KeyRole::kRobot, name));
  }
  // Opens a core and expects that `stranger` finds nobody there, while a robot with keys does.
  void expectStranger(const DdsLinkOptions& stranger_options, const std::string& core_says) {
    Notices told;
    DdsLinkOptions core_options = core();
    core_options.notice = told.sink();
    const auto service = open(core_options), stranger = open(stranger_options), friendly = open(robot("friend"));
    ASSERT_TRUE(service && stranger && friendly);
    EXPECT_TRUE(waitForPeers(*friendly, 1)) << "robots with keys are served";
    EXPECT_TRUE(told.awaits(core_says)) << told.text();
    ASSERT_TRUE(stranger->publish(Topic::kHello, stranger_options.robot, std::vector<uint8_t>{1}));
    ASSERT_TRUE(friendly->publish(Topic::kHello, "friend", std::vector<uint8_t>{2}));
    const auto got = service->receive(20s);
    ASSERT_TRUE(got);
    EXPECT_EQ(got->robot, "friend");
    EXPECT_FALSE(service->receive(500ms)) << "the stranger was heard";
    EXPECT_EQ(stranger->peers(), 0);
  }

  SiteKeys keys_{kSite};
};

TEST_F(KeyedPeers, ARobotWithoutKeysIsNotLetInAndBothAreTold) {
  Notices told;
  DdsLinkOptions plain = optionsOf(LinkRole::kRobot, "plain", "");
  plain.notice = told.sink();
  expectStranger(plain, "comap/robot/plain has no keys");
  EXPECT_TRUE(told.awaits("comap/core wants keys and this program has none")) << told.text();
}

TEST_F(KeyedPeers, ARobotOfAnotherAuthorityIsNotLetIn) {
  SiteKeys other(kSite);
  expectStranger(optionsOf(LinkRole::kRobot, "a", other.of(KeyRole::kRobot, "a")),
                 "comap/robot/a has keys of another authority");
}

TEST_F(KeyedPeers, ARevokedRobotIsNotLetIn) {
  keys_.of(KeyRole::kCore, "core");  // before: its list must be renewed
  const std::string folder = keys_.of(KeyRole::kRobot, "a"), copy = keys_.path() + "-copy";
  fs::copy(folder, copy, fs::copy_options::recursive);  // on the robot, where nobody brings the new list
  const auto revoked = revokeParticipant(keys_.path(), "a");
  ASSERT_TRUE(revoked);
  EXPECT_EQ(*revoked, std::vector<std::string>{keys_.path() + "/core"});
  expectStranger(optionsOf(LinkRole::kRobot, "a", copy), "revoked");
  fs::remove_all(copy);
  // Its name can be given again.
  const auto service = open(core()), again = open(robot("a"));
  ASSERT_TRUE(service && again);
  EXPECT_TRUE(waitForPeers(*again, 1));
}

// --- Revoked while it is connected.

// A core with robots a and b connected; a's folder is on a's machine, where nobody brings the new list.
class RevokedWhileConnected : public KeyedPeers {
 protected:
  RevokedWhileConnected() {
    keys_.of(KeyRole::kCore, "core");
    keys_.of(KeyRole::kRobot, "b");
    fs::copy(keys_.of(KeyRole::kRobot, "a"), on_a_, fs::copy_options::recursive);
    DdsLinkOptions core_options = core(), robot_options = optionsOf(LinkRole::kRobot, "a", on_a_);
    core_options.notice = core_told_.sink();
    robot_options.notice = robot_told_.sink();
    core_ = open(core_options);
    a_ = open(robot_options);
    b_ = open(robot("b"));
  }
  ~RevokedWhileConnected() override { fs::remove_all(on_a_); }
  // Says it again until the core hears it; whether it does.
  bool hears(Link& robot, const std::string& name, std::chrono::milliseconds limit) {
    for (const auto until = std::chrono::steady_clock::now() + limit; std::chrono::steady_clock::now() < until;) {
      static_cast<void>(bool(robot.publish(Topic::kStatus, name, std::vector<uint8_t>{1})));
      if (const auto got = core_->receive(100ms); got && got->robot == name) return true;
    }
    return false;
  }
  std::string listOfCore() const { return keys_.path() + "/core/revoked.pem"; }

  const std::string on_a_ = keys_.path() + "-a";
  Notices core_told_, robot_told_;
  std::unique_ptr<Link> core_, a_, b_;
};

TEST_F(RevokedWhileConnected, ARobotIsShutOutOfTheRunningCoreAndOthersStay) {
  ASSERT_TRUE(hears(*a_, "a", 20s) && hears(*b_, "b", 20s));
  ASSERT_TRUE(revokeParticipant(keys_.path(), "a"));
  const std::string told = listOfCore() + " lists 1 certificates more: joining anew";
  for (int i = 0; i < 400 && core_told_.text().find(told) == std::string::npos; ++i)
    static_cast<void>(core_->receive(50ms));
  ASSERT_THAT(core_told_.text(), HasSubstr(told));
  EXPECT_TRUE(hears(*b_, "b", 20s)) << "who is not revoked is let in again";
  EXPECT_FALSE(hears(*a_, "a", 3s));
  EXPECT_TRUE(core_told_.awaits("comap/robot/a was not let in: its certificate is revoked")) << core_told_.text();
  EXPECT_EQ(a_->peers(), 0);
  EXPECT_EQ(b_->peers(), 1);
}

TEST_F(RevokedWhileConnected, ARobotThatGetsTheListStopsByItself) {
  ASSERT_TRUE(hears(*a_, "a", 20s));
  const std::string before = listOfCore() + ".before";
  fs::copy_file(listOfCore(), before);
  ASSERT_TRUE(revokeParticipant(keys_.path(), "a"));
  const std::string list = contentOf(listOfCore());
  overwrite(on_a_ + "/revoked.pem", list);
  for (int i = 0; i < 400 && a_->trouble().empty(); ++i) {
    static_cast<void>(a_->receive(50ms));
    std::this_thread::sleep_for(10ms);
  }
  EXPECT_THAT(a_->trouble(), AllOf(HasSubstr(on_a_ + "/certificate.pem: revoked, says "),
                                   HasSubstr("nothing is sent or received with it any more")));
  EXPECT_EQ(a_->peers(), 0);
  const auto said = a_->publish(Topic::kStatus, "a", std::vector<uint8_t>{1});
  ASSERT_FALSE(said);
  EXPECT_EQ(said.error().code, ErrorCode::kUnreachable);
  EXPECT_EQ(said.error().text, a_->trouble());
  EXPECT_TRUE(robot_told_.awaits("revoked, says")) << robot_told_.text();
  // New keys of the same name in the same folder bring it back.
  fs::remove_all(on_a_);
  fs::copy(keys_.of(KeyRole::kRobot, "a"), on_a_, fs::copy_options::recursive);
  EXPECT_TRUE(hears(*a_, "a", 20s)) << robot_told_.text() << core_told_.text();
}

TEST_F(RevokedWhileConnected, AListThatCannotBeUsedChangesNothing) {
  ASSERT_TRUE(hears(*a_, "a", 20s));
  const SiteKeys other(kSite);
  for (const std::string& list :
       {std::string("-----BEGIN X509 CRL-----\nhalf"), contentOf(other.path() + "/authority/revoked.pem")}) {
    Notices& told = core_told_;
    const size_t before = told.text().size();
    overwrite(listOfCore(), list);
    for (int i = 0; i < 200 && told.text().size() == before; ++i) static_cast<void>(core_->receive(50ms));
    EXPECT_THAT(told.text().substr(before), AllOf(HasSubstr("cannot be used: "), HasSubstr(listOfCore()),
                                                  HasSubstr("the one before it stays in force")));
    EXPECT_TRUE(hears(*a_, "a", 20s));
  }
  EXPECT_EQ(core_told_.text().find("joining anew"), std::string::npos) << core_told_.text();
}

// --- What a robot's key is good for, asked of DDS itself, past all checks of our own.

class RawRobot {
 public:
  explicit RawRobot(const DdsLinkOptions& options) {
    participant_ = dds::DomainParticipantFactory::get_instance()->create_participant(
        static_cast<uint32_t>(options.domain), participantQos("comap/robot/raw", options));
    if (participant_ != nullptr) type_.register_type(participant_);
  }
  ~RawRobot() {
    if (participant_ == nullptr) return;
    participant_->delete_contained_entities();
    dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
  }
  bool joined() const { return participant_ != nullptr; }
  /// nullptr if DDS refuses it.
  dds::DataWriter* writerOf(Topic topic, const std::string& partition) {
    dds::PublisherQos qos = dds::PUBLISHER_QOS_DEFAULT;
    qos.partition().push_back(partition.c_str());
    return participant_->create_publisher(qos)->create_datawriter(topicOf(topic), writerQos(topic, 1000));
  }
  dds::DataReader* readerOf(Topic topic, const std::string& partition) {
    dds::SubscriberQos qos = dds::SUBSCRIBER_QOS_DEFAULT;
    qos.partition().push_back(partition.c_str());
    return participant_->create_subscriber(qos)->create_datareader(topicOf(topic), readerQos(topic));
  }

 private:
  dds::Topic* topicOf(Topic topic) {
    dds::Topic*& made = topics_[topic];
    if (made == nullptr)
      made = participant_->create_topic(topicName(topic), type_.get_type_name(), dds::TOPIC_QOS_DEFAULT);
    return made;
  }

  dds::TypeSupport type_{new OctetsType};
  dds::DomainParticipant* participant_ = nullptr;
  std::map<Topic, dds::Topic*> topics_;
};

std::string partitionOf(const std::string& robot) { return std::string(kSite) + "/" + robot; }

TEST_F(KeyedPeers, ARobotsKeyWritesWhatRobotsWriteAndReadsWhatTheyRead) {
  RawRobot thief(robot("a"));
  ASSERT_TRUE(thief.joined());
  for (const Topic topic : kAllTopics) {
    EXPECT_EQ(thief.writerOf(topic, partitionOf("a")) != nullptr, writes(LinkRole::kRobot, topic)) << topicName(topic);
    EXPECT_EQ(thief.readerOf(topic, partitionOf("a")) != nullptr, reads(LinkRole::kRobot, topic)) << topicName(topic);
  }
}

TEST_F(KeyedPeers, ARobotsKeyIsNoneInAnothersPartitionOrSite) {
  RawRobot thief(robot("a"));
  ASSERT_TRUE(thief.joined());
  for (const std::string& partition :
       {partitionOf("b"), partitionOf("*"), std::string("elsewhere"), std::string("*")}) {
    EXPECT_EQ(thief.writerOf(Topic::kHello, partition), nullptr) << partition;
    EXPECT_EQ(thief.readerOf(Topic::kTile, partition), nullptr) << partition;
  }
}

TEST_F(KeyedPeers, DocumentsThatTheAuthorityDidNotSignDoNotJoin) {
  DdsLinkOptions options = robot("a");
  replaceIn(options.keys + "/permissions.p7s", "comap/v1/hello", "comap/v1/ack");
  EXPECT_FALSE(RawRobot(options).joined());
}

TEST_F(KeyedPeers, OneRobotIsNotHeardInTheNameOfAnother) {
  Notices told;
  DdsLinkOptions core_options = core();
  core_options.notice = told.sink();
  const auto service = open(core_options);
  RawRobot b(robot("b"));
  ASSERT_TRUE(service && b.joined());
  dds::DataWriter* writer = b.writerOf(Topic::kHello, partitionOf("b"));
  ASSERT_NE(writer, nullptr);
  Octets forged{"a", {1, 2, 3}}, honest{"b", {4, 5}};
  ASSERT_TRUE(writer->write(&forged));
  ASSERT_TRUE(writer->write(&honest));
  const auto got = service->receive(20s);
  ASSERT_TRUE(got);
  EXPECT_EQ(got->robot, "b");
  EXPECT_EQ(got->payload, honest.payload);
  EXPECT_FALSE(service->receive(300ms));
  EXPECT_THAT(told.text(),
              HasSubstr("in the name of robot 'a' from a participant whose certificate is not that robot's"));
}

TEST(KeyedLink, LeavesTheMachineOnlyWithKeysOrTheWord) {
  ifaddrs* interfaces = nullptr;
  ASSERT_EQ(getifaddrs(&interfaces), 0);
  std::string name;
  for (const ifaddrs* one = interfaces; one != nullptr; one = one->ifa_next)
    if (one->ifa_addr != nullptr && one->ifa_addr->sa_family == AF_INET && (one->ifa_flags & IFF_LOOPBACK) == 0)
      name = one->ifa_name;
  freeifaddrs(interfaces);
  if (!name.empty()) {
    const auto link = connectDds({testDomain(), kSite, LinkRole::kCore, "", name});
    ASSERT_FALSE(link) << name << " was opened in clear text";
    EXPECT_EQ(link.error().code, ErrorCode::kWrongUse);
    EXPECT_THAT(link.error().text, AllOf(HasSubstr("'fleet keys'"), HasSubstr("--insecure")));
    return;
  }
  GTEST_SKIP() << "no network interface besides loopback";
}

}  // namespace
}  // namespace comap
