// Client and server over loopback, with sockets in DDS's place.
#include "protocol/discovery/discovery_client.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <mutex>

#include "protocol/discovery/discovery_ask.h"
#include "protocol/discovery/discovery_server.h"
#include "tests/protocol/discovery/announcement_message.h"

namespace comap {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

constexpr uint32_t kHere = 0x7f000001;

class Lines {
 public:
  std::function<void(const std::string&)> sink() {
    return [this](const std::string& line) {
      const std::lock_guard lock(mutex_);
      lines_ += line + "\n";
    };
  }
  bool hear(const std::string& part, seconds patience = seconds(20)) {
    for (auto until = std::chrono::steady_clock::now() + patience; std::chrono::steady_clock::now() < until;) {
      if (all().find(part) != std::string::npos) return true;
      std::this_thread::sleep_for(milliseconds(10));
    }
    return false;
  }
  std::string all() const {
    const std::lock_guard lock(mutex_);
    return lines_;
  }

 private:
  mutable std::mutex mutex_;
  std::string lines_;
};

DatagramSocket anySocket() {
  auto socket = DatagramSocket::bind({kHere, 0, 0});
  EXPECT_TRUE(socket);
  return std::move(*socket);
}

// What DDS does: announces itself to the client, and listens on the port that its announcement names.
class Dds {
 public:
  explicit Dds(uint8_t number) : socket_(anySocket()) {
    prefix_.fill(number);
    message_ = AnnouncementMessage(prefix_)
                   .locator(AnnouncementMessage::kMetatrafficUnicast, AnnouncementMessage::kUdp4, socket_.port())
                   .end();
  }
  const ParticipantPrefix& prefix() const { return prefix_; }
  const std::vector<uint8_t>& message() const { return message_; }
  void announce(uint16_t client) const { socket_.send({kHere, client, 0}, message_); }
  /// What comes, and from whom.
  std::optional<std::vector<uint8_t>> hear(milliseconds patience) const {
    Endpoint from;
    return socket_.receive(patience, from);
  }
  /// Announces until something comes; of whom it is told.
  std::optional<int> exchange(uint16_t client, seconds patience = seconds(20)) {
    for (auto until = std::chrono::steady_clock::now() + patience; std::chrono::steady_clock::now() < until;) {
      announce(client);
      if (const auto bytes = hear(milliseconds(50)))
        if (const auto sender = senderOf(*bytes)) return sender->front();
    }
    return std::nullopt;
  }

 private:
  DatagramSocket socket_;
  ParticipantPrefix prefix_{};
  std::vector<uint8_t> message_;
};

std::unique_ptr<DiscoveryClient> connect(const std::string& server, MemberRole role, const std::string& site,
                                         const Dds& dds, Lines& lines) {
  auto client = DiscoveryClient::start({server, "127.0.0.1", 42, site, role, lines.sink()});
  EXPECT_TRUE(client) << client.error().text;
  (*client)->follow(dds.prefix());
  return std::move(*client);
}

std::unique_ptr<DiscoveryServer> serve(uint16_t port, Lines& lines) {
  auto server = DiscoveryServer::start({kHere, port, 0}, lines.sink());
  EXPECT_TRUE(server) << server.error().text;
  return std::move(*server);
}

TEST(DiscoveryClient, ParticipantsOfASiteHearOfEachOther) {
  Lines of_server, of_core, of_robot;
  const auto server = serve(0, of_server);
  const std::string at = "127.0.0.1:" + std::to_string(server->port());
  Dds core(1), robot(2), stranger(3);
  const auto core_client = connect(at, MemberRole::kCore, "flat", core, of_core);
  const auto stranger_client = connect(at, MemberRole::kCore, "attic", stranger, of_core);
  EXPECT_FALSE(core.exchange(core_client->port(), seconds(1)));
  EXPECT_FALSE(stranger.exchange(stranger_client->port(), seconds(1)));
  {
    const auto robot_client =
        connect("localhost:" + std::to_string(server->port()), MemberRole::kRobot, "flat", robot, of_robot);
    EXPECT_EQ(robot.exchange(robot_client->port()), 1);
    EXPECT_EQ(core.exchange(core_client->port()), 2);
    EXPECT_FALSE(stranger.exchange(stranger_client->port(), seconds(1)));
    EXPECT_TRUE(of_robot.hear("answers; 1 others of site flat")) << of_robot.all();
    EXPECT_EQ(robot_client->trouble(), "");
    const auto counts = askDiscovery(at, 42, "flat", seconds(10));
    ASSERT_TRUE(counts);
    EXPECT_EQ(counts->robots, 1);
    EXPECT_EQ(counts->cores, 1);
    EXPECT_EQ(counts->all, 3);
  }
  EXPECT_TRUE(of_server.hear("left")) << "a client that ends says so: " << of_server.all();
}

TEST(DiscoveryClient, OnlyItsOwnParticipantIsPassedOn) {
  Lines lines;
  const auto server = serve(0, lines);
  const std::string at = "127.0.0.1:" + std::to_string(server->port());
  Dds core(1), robot(2), passer_by(3);
  const auto core_client = connect(at, MemberRole::kCore, "flat", core, lines);
  const auto robot_client = connect(at, MemberRole::kRobot, "flat", robot, lines);
  EXPECT_FALSE(passer_by.exchange(robot_client->port(), seconds(1)));
  EXPECT_FALSE(core.exchange(core_client->port(), seconds(1)));
}

TEST(DiscoveryClient, AServerThatIsSilentIsToldOnceAndFoundAgainWhenItComes) {
  Lines of_server, lines;
  uint16_t port = 0;
  {
    const auto first = serve(0, of_server);
    port = first->port();
  }
  const std::string at = "127.0.0.1:" + std::to_string(port);
  Dds core(1), robot(2);
  const auto core_client = connect(at, MemberRole::kCore, "flat", core, lines);
  Lines of_robot;
  const auto robot_client = connect(at, MemberRole::kRobot, "flat", robot, of_robot);
  EXPECT_FALSE(robot.exchange(robot_client->port(), seconds(1)));
  ASSERT_TRUE(of_robot.hear("discovery server " + at + " does not answer")) << of_robot.all();
  EXPECT_THAT(robot_client->trouble(), HasSubstr(at + " does not answer: is it running there"));
  for (int start = 0; start < 2; ++start) {
    const auto server = serve(port, of_server);
    // They announce all the time, as DDS does.
    std::atomic<bool> done = false;
    std::thread core_dds([&] {
      while (!done) core.exchange(core_client->port(), seconds(1));
    });
    EXPECT_EQ(robot.exchange(robot_client->port()), 1) << "start " << start;
    done = true;
    core_dds.join();
    EXPECT_TRUE(of_robot.hear("answers; ")) << of_robot.all();
    EXPECT_EQ(robot_client->trouble(), "");
  }
  const std::string told = of_robot.all();
  EXPECT_EQ(told.find("does not answer"), told.rfind("does not answer")) << "once: " << told;
}

// In a server's place: a socket that answers what the test tells it to.
class Pretender {
 public:
  Pretender() : socket_(anySocket()) {}
  std::string at() const { return "127.0.0.1:" + std::to_string(socket_.port()); }
  /// The next note and its sender, if one comes in time.
  std::optional<Note> hear(milliseconds patience = seconds(20)) {
    const auto bytes = socket_.receive(patience, client_);
    return bytes ? decodeNote(*bytes) : std::nullopt;
  }
  void say(const Note& note) const { socket_.send(client_, encodeNote(note)); }

 private:
  DatagramSocket socket_;
  Endpoint client_;
};

TEST(DiscoveryClient, AServerThatTakesAllAndAnswersNothingIsToldAsSilent) {
  Lines lines;
  Pretender server;
  Dds robot(1);
  const auto client = connect(server.at(), MemberRole::kRobot, "flat", robot, lines);
  robot.announce(client->port());
  const auto note = server.hear();
  ASSERT_TRUE(note);
  EXPECT_EQ(note->kind, NoteKind::kAnnounce);
  EXPECT_EQ(note->announcement, robot.message());
  EXPECT_TRUE(lines.hear("discovery server " + server.at() + " does not answer")) << lines.all();
  EXPECT_THAT(client->trouble(), HasSubstr("does not answer"));
}

TEST(DiscoveryClient, AServerThatAlwaysWantsAnotherCookieKeepsNobodyBusy) {
  Lines lines;
  Pretender server;
  Dds robot(1);
  const auto client = connect(server.at(), MemberRole::kRobot, "flat", robot, lines);
  for (uint8_t round = 0; round < 3; ++round) {
    robot.announce(client->port());
    int heard = 0;
    Note answer;
    answer.kind = NoteKind::kCookie;
    answer.site = siteCode(42, "flat");
    while (const auto note = server.hear(heard < 2 ? milliseconds(20000) : milliseconds(300))) {
      EXPECT_TRUE(heard == 0 || note->cookie == answer.cookie) << "it says again what it was given";
      answer.cookie.fill(static_cast<uint8_t>(100 * round + ++heard));
      server.say(answer);
      ASSERT_LE(heard, 2) << "once with the first cookie, and then not before DDS announces again";
    }
    EXPECT_EQ(heard, 2);
  }
}

TEST(DiscoveryClient, ItsDdsIsHandedAnnouncementsOnly) {
  Lines lines;
  Pretender server;
  Dds robot(1), core(2);
  const auto client = connect(server.at(), MemberRole::kRobot, "flat", robot, lines);
  robot.announce(client->port());
  ASSERT_TRUE(server.hear());
  Note introduction;
  introduction.kind = NoteKind::kIntroduce;
  introduction.site = siteCode(42, "flat");
  for (const auto& bytes :
       {std::vector<uint8_t>(100, 1),
        AnnouncementMessage(core.prefix(), core.prefix(), true, true, AnnouncementMessage::kOtherWriter).end(),
        AnnouncementMessage(core.prefix(), robot.prefix()).end(), core.message()}) {
    introduction.announcement = bytes;
    server.say(introduction);
  }
  EXPECT_EQ(robot.hear(seconds(20)), core.message()) << "the last alone";
  EXPECT_FALSE(robot.hear(milliseconds(300)));
}

TEST(DiscoveryClient, ANameThatNobodyKnowsIsSaid) {
  Lines lines;
  Dds robot(1);
  const auto client = connect("no-such-host.invalid", MemberRole::kRobot, "flat", robot, lines);
  ASSERT_TRUE(lines.hear("cannot be found: this machine's resolver does not know the name 'no-such-host.invalid'"))
      << lines.all();
}

TEST(DiscoveryServer, APortThatIsTakenIsSaid) {
  Lines lines;
  const auto server = serve(0, lines);
  const auto second = DiscoveryServer::start({kHere, server->port(), 0}, lines.sink());
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::kUnreachable);
  EXPECT_THAT(second.error().text, HasSubstr("discovery server: UDP 127.0.0.1:"));
}

}  // namespace
}  // namespace comap
