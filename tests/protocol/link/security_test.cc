// Keys on the wire, with real participants: who may join, what each may do, and what is said when it may not.
#include "protocol/link/security.h"

#include <fastrtps/config.h>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <map>

#include "protocol/link/octets_type.h"
#include "protocol/link/qos.h"
#include "protocol/link/topics.h"
#include "tests/protocol/link/keyed_link.h"

namespace comap {
namespace {

namespace dds = eprosima::fastdds::dds;
namespace fs = std::filesystem;
using namespace std::chrono_literals;
using testing::HasSubstr;

// --- Who is not let in.

class Strangers : public KeyedPeers {
 protected:
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
};

TEST_F(Strangers, ARobotWithoutKeysIsNotLetInAndBothAreTold) {
  Notices told;
  DdsLinkOptions plain = optionsOf(LinkRole::kRobot, "plain", "");
  plain.notice = told.sink();
  expectStranger(plain, "comap/robot/plain has no keys");
  EXPECT_TRUE(told.awaits("comap/core wants keys and this program has none")) << told.text();
}

TEST_F(Strangers, ARobotOfAnotherAuthorityIsNotLetIn) {
  SiteKeys other(kSite);
  expectStranger(optionsOf(LinkRole::kRobot, "a", other.of(KeyRole::kRobot, "a")),
                 "comap/robot/a has keys of another authority");
}

TEST_F(Strangers, ARevokedRobotIsNotLetIn) {
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

// Tiles are encrypted for one participant, which nobody else may be.
TEST_F(KeyedPeers, AToolsKeyReadsAndAsksForItsOwnTilesAlone) {
  RawRobot tool(optionsOf(LinkRole::kObserver, "eye", keys_.of(KeyRole::kTool, "eye")));
  ASSERT_TRUE(tool.joined());
  EXPECT_NE(tool.readerOf(Topic::kTile, partitionOf("eye")), nullptr);
  EXPECT_NE(tool.writerOf(Topic::kInterest, partitionOf("eye")), nullptr);
  EXPECT_NE(tool.readerOf(Topic::kCorrection, partitionOf("*")), nullptr);
  for (const std::string& partition : {partitionOf("a"), partitionOf("*"), std::string(kSite)}) {
    EXPECT_EQ(tool.readerOf(Topic::kTile, partition), nullptr) << partition;
    EXPECT_EQ(tool.writerOf(Topic::kInterest, partition), nullptr) << partition;
  }
  for (const Topic topic : {Topic::kKeyframe, Topic::kInterest})
    EXPECT_EQ(tool.readerOf(topic, partitionOf("a")), nullptr) << topicName(topic);
}

TEST_F(KeyedPeers, DocumentsThatTheAuthorityDidNotSignDoNotJoin) {
  DdsLinkOptions options = robot("a");
  replaceIn(options.keys + "/permissions.p7s", "comap/v1/hello", "comap/v1/ack");
  EXPECT_FALSE(RawRobot(options).joined());
}

// Each pace has a writer of its own, and each must learn what has arrived: a writer holds 16 keyframes.
TEST_F(KeyedPeers, EveryPacesWriterIsConfirmed) {
  DdsLinkOptions core_options = core(), robot_options = robot("a");
  core_options.profile = robot_options.profile = "lan";  // on loopback all the same
  const auto service = open(core_options), sender = open(robot_options);
  ASSERT_TRUE(service && sender);
  ASSERT_TRUE(waitForPeers(*sender, 1) && waitForPeers(*service, 1));
  // Nothing small is sent, so the pace stays what it is without being measured: not the first writer's.
  const std::vector<uint8_t> keyframe(20000, 7);
  for (int i = 0; i < 50; ++i) {
    const auto sent = sender->publish(Topic::kKeyframe, "a", keyframe);
    ASSERT_TRUE(sent) << i << ": " << sent.error().text;
    ASSERT_TRUE(service->receive(20s)) << i;
  }
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

}  // namespace
}  // namespace comap
