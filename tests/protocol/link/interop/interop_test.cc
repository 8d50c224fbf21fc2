// Whether docs/wire.md is enough for another vendor's DDS to take part.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <thread>

#include "protocol/link/dds_link.h"

#ifndef CYCLONE_PEER
#define CYCLONE_PEER ""
#endif

namespace comap {
namespace {

using namespace std::chrono_literals;

int testDomain() { return 100 + getpid() % 121; }

// Nobody is found by multicast on loopback: the peer asks there by itself.
std::string peerCommand(const std::string& arguments) {
  return "CYCLONEDDS_URI='<CycloneDDS><Domain><General><AllowMulticast>false</AllowMulticast><Interfaces>"
         "<NetworkInterface name=\"lo\" multicast=\"false\"/></Interfaces></General><Discovery>"
         "<ParticipantIndex>auto</ParticipantIndex><Peers><Peer address=\"127.0.0.1\"/></Peers></Discovery>"
         "</Domain></CycloneDDS>' timeout 60 " CYCLONE_PEER " " +
         arguments;
}

// Runs the peer and keeps what it writes.
class Peer {
 public:
  explicit Peer(const std::string& arguments)
      : pipe_(popen(peerCommand(arguments).c_str(), "r")), reader_([this] {
          for (int c = std::fgetc(pipe_); c != EOF; c = std::fgetc(pipe_)) out_.push_back(static_cast<uint8_t>(c));
          const int status = pclose(pipe_);
          exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
          ended_ = true;
        }) {}
  ~Peer() { end(); }
  int end() {
    if (reader_.joinable()) reader_.join();
    return exit_code_;
  }
  const std::vector<uint8_t>& out() const { return out_; }
  bool ended() const { return ended_; }

 private:
  FILE* pipe_;
  std::vector<uint8_t> out_;
  int exit_code_ = -1;
  std::atomic<bool> ended_ = false;
  std::thread reader_;
};

class Interop : public testing::Test {
 protected:
  void SetUp() override {
    if (std::string(CYCLONE_PEER).empty())
      GTEST_SKIP()
          << "no other vendor's DDS: packages cyclonedds-dev and cyclonedds-tools were not there at build time";
  }
  std::string place() const { return std::to_string(testDomain()) + " interop"; }
  static std::unique_ptr<Link> connect(LinkRole role, const std::string& robot) {
    auto link = connectDds({testDomain(), "interop", role, robot, "127.0.0.1"});
    if (!link) ADD_FAILURE() << link.error().text;
    return link ? std::move(*link) : nullptr;
  }
};

std::vector<uint8_t> pattern(size_t size) {
  std::vector<uint8_t> bytes(size);
  for (size_t i = 0; i < size; ++i) bytes[i] = static_cast<uint8_t>(i * 7 + i / 256);
  return bytes;
}

TEST_F(Interop, AnotherVendorsSubscriberReadsAKeyframe) {
  auto robot = connect(LinkRole::kRobot, "a");
  ASSERT_TRUE(robot);
  Peer peer("read " + place());
  // It is no core, which reads more than keyframes: peers() does not count it. So it is sent until it is taken.
  std::vector<uint8_t> payload = pattern(300001);
  for (int i = 0; i < 30 && !peer.ended(); ++i) {
    ASSERT_TRUE(robot->publish(Topic::kKeyframe, "a", payload));
    std::this_thread::sleep_for(500ms);
  }
  EXPECT_EQ(peer.end(), 0) << "the step that failed, see cyclone_peer";
  EXPECT_TRUE(peer.out() == payload) << peer.out().size() << " bytes";
}

TEST_F(Interop, AnotherVendorsRobotIsServed) {
  auto core = connect(LinkRole::kCore, "");
  ASSERT_TRUE(core);
  Peer peer("write " + place() + " 300001");
  const auto got = core->receive(20s);
  ASSERT_TRUE(got);
  EXPECT_EQ(got->topic, Topic::kKeyframe);
  EXPECT_EQ(got->robot, "b");
  EXPECT_TRUE(got->payload == pattern(300001)) << got->payload.size() << " bytes";
  ASSERT_TRUE(core->publish(Topic::kAck, "b", std::vector<uint8_t>{1, 2, 3}));
  EXPECT_EQ(peer.end(), 0) << "the step that failed, see cyclone_peer";
}

}  // namespace
}  // namespace comap
