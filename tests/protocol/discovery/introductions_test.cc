#include "protocol/discovery/introductions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/protocol/discovery/announcement_message.h"

namespace comap {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

// A server without a network, and those who write to it.
class IntroductionsTest : public testing::Test {
 protected:
  struct Participant {
    Endpoint at;
    MemberRole role;
    std::string site = "flat";
    Cookie cookie{};
    std::vector<uint8_t> announcement{};
  };
  Participant make(uint8_t number, MemberRole role, const std::string& site = "flat") {
    return {{0x0a000000u + number, 40000, 0}, role, site, {}, announcementOf(number)};
  }
  static std::vector<uint8_t> announcementOf(uint8_t number) {
    ParticipantPrefix prefix;
    prefix.fill(number);
    return AnnouncementMessage(prefix).end();
  }
  static Note noteOf(const Participant& who, NoteKind kind) {
    Note note;
    note.kind = kind;
    note.role = who.role;
    note.cookie = who.cookie;
    note.site = siteCode(42, who.site);
    if (kind == NoteKind::kAnnounce) note.announcement = who.announcement;
    return note;
  }
  std::vector<std::pair<Endpoint, Note>> say(const Participant& who, NoteKind kind) {
    std::vector<std::pair<Endpoint, Note>> out;
    for (const auto& [to, bytes] : server_->take(who.at, encodeNote(noteOf(who, kind)), now_)) {
      const auto note = decodeNote(bytes);
      EXPECT_TRUE(note);
      if (note) out.emplace_back(to, *note);
    }
    return out;
  }
  // With the cookie that the server wants; what it sends for the announcement itself.
  std::vector<std::pair<Endpoint, Note>> join(Participant& who) {
    auto first = say(who, NoteKind::kAnnounce);
    EXPECT_EQ(first.size(), 1u);
    if (first.size() != 1 || first[0].second.kind != NoteKind::kCookie) return first;
    EXPECT_EQ(first[0].first, who.at);
    who.cookie = first[0].second.cookie;
    return say(who, NoteKind::kAnnounce);
  }
  // Who is told of whom.
  static std::vector<std::string> told(const std::vector<std::pair<Endpoint, Note>>& notes) {
    std::vector<std::string> out;
    for (const auto& [to, note] : notes)
      if (note.kind == NoteKind::kIntroduce)
        out.push_back(std::to_string(to.address & 255) + "<" + std::to_string(senderOf(note.announcement)->front()));
    std::sort(out.begin(), out.end());
    return out;
  }

  std::vector<std::string> lines_;
  std::unique_ptr<Introductions> server_ = std::make_unique<Introductions>(
      std::array<uint8_t, 32>{1}, [this](const std::string& line) { lines_.push_back(line); });
  Introductions::Clock::time_point now_ = Introductions::Clock::time_point() + std::chrono::hours(1);
};

using Told = std::vector<std::string>;

TEST_F(IntroductionsTest, CoreAndRobotAreToldOfEachOtherWhoeverComesFirst) {
  auto core = make(1, MemberRole::kCore), a = make(2, MemberRole::kRobot), b = make(3, MemberRole::kRobot);
  EXPECT_EQ(told(join(a)), Told{});
  EXPECT_EQ(told(join(core)), (Told{"1<2", "2<1"}));
  EXPECT_EQ(told(join(b)), (Told{"1<3", "3<1"})) << "robots have nothing to say to each other";
  auto viewer = make(4, MemberRole::kObserver);
  EXPECT_EQ(told(join(viewer)), (Told{"1<4", "2<4", "3<4", "4<1", "4<2", "4<3"}));
  EXPECT_EQ(server_->members(), 4u);
  EXPECT_THAT(lines_.back(), testing::HasSubstr("observer at 10.0.0.4:40000 came; 4 of its site"));
}

TEST_F(IntroductionsTest, SitesAreNotMixed) {
  auto core = make(1, MemberRole::kCore), other = make(2, MemberRole::kCore, "attic"),
       robot = make(3, MemberRole::kRobot, "attic");
  join(core);
  join(other);
  const auto sent = join(robot);
  EXPECT_EQ(told(sent), (Told{"2<3", "3<2"}));
  ASSERT_EQ(sent.front().second.kind, NoteKind::kWelcome);
  EXPECT_EQ(sent.front().second.count, 1) << "others of the site, not of all";
}

TEST_F(IntroductionsTest, WithoutTheCookieOfItsOwnAddressNothingIsTaken) {
  auto core = make(1, MemberRole::kCore), robot = make(2, MemberRole::kRobot);
  join(core);
  const auto asked = say(robot, NoteKind::kAnnounce);
  ASSERT_EQ(asked.size(), 1u) << "one answer, to who asked";
  EXPECT_LE(encodeNote(asked[0].second).size(), encodeNote(noteOf(robot, NoteKind::kAnnounce)).size());
  EXPECT_EQ(server_->members(), 1u);
  robot.cookie = core.cookie;
  EXPECT_EQ(say(robot, NoteKind::kAnnounce).front().second.kind, NoteKind::kCookie);
  // Another server, or this one started anew, gives another.
  join(robot);
  Introductions anew({2}, [](const std::string&) {});
  const auto answer = anew.take(robot.at, encodeNote(noteOf(robot, NoteKind::kAnnounce)), now_);
  ASSERT_EQ(answer.size(), 1u);
  EXPECT_EQ(decodeNote(answer[0].bytes)->kind, NoteKind::kCookie);
}

TEST_F(IntroductionsTest, AllIsToldAgainButNotAlways) {
  auto core = make(1, MemberRole::kCore), robot = make(2, MemberRole::kRobot);
  join(core);
  join(robot);
  now_ += milliseconds(500);
  EXPECT_EQ(told(say(robot, NoteKind::kAnnounce)), Told{});
  now_ += milliseconds(1500);
  EXPECT_EQ(told(say(robot, NoteKind::kAnnounce)), Told{"1<2"}) << "the first may have been lost";
  now_ += milliseconds(600);
  robot.announcement = announcementOf(9);
  EXPECT_EQ(told(say(robot, NoteKind::kAnnounce)), Told{"1<9"}) << "another address of the same robot, say";
  robot.announcement = announcementOf(8);
  EXPECT_EQ(told(say(robot, NoteKind::kAnnounce)), Told{}) << "a flood is not passed on";
  now_ += milliseconds(600);
  EXPECT_EQ(told(say(robot, NoteKind::kAnnounce)), Told{"1<8"}) << "but its end is";
  now_ += milliseconds(600);
  EXPECT_EQ(told(say(robot, NoteKind::kAnnounce)), Told{}) << "no news";
}

// Each other gets a datagram of a hundred times the size of the one that asks to be forgotten.
TEST_F(IntroductionsTest, LeavingAndComingAgainFloodsNobody) {
  auto core = make(1, MemberRole::kCore), robot = make(2, MemberRole::kRobot);
  join(core);
  EXPECT_EQ(told(join(robot)), (Told{"1<2", "2<1"}));
  const size_t lines = lines_.size();
  for (int i = 0; i < 1000; ++i) {
    EXPECT_TRUE(say(robot, NoteKind::kLeave).empty());
    EXPECT_TRUE(say(robot, NoteKind::kAnnounce).empty());
  }
  EXPECT_LE(lines_.size(), lines + 1);
  EXPECT_EQ(server_->members(), 1u) << "who has left is not there";
  EXPECT_EQ(say(robot, NoteKind::kAsk).front().second.count, 1);
  auto viewer = make(3, MemberRole::kObserver);
  EXPECT_EQ(told(join(viewer)), (Told{"1<3", "3<1"})) << "nor told of it";
  now_ += seconds(2);
  EXPECT_EQ(told(say(robot, NoteKind::kAnnounce)), (Told{"1<2", "2<1", "2<3", "3<2"})) << "it may come again later";
  EXPECT_EQ(server_->members(), 3u);
}

TEST_F(IntroductionsTest, LeavingMakesNoRoomForMoreThanOneAddressMayHave) {
  size_t taken = 0;
  for (uint16_t port = 1; port <= 300; ++port) {
    auto many = make(2, MemberRole::kRobot);
    many.at.port = port;
    taken += join(many).front().second.kind == NoteKind::kWelcome ? 1 : 0;
    say(many, NoteKind::kLeave);
  }
  EXPECT_EQ(taken, 128u);
  EXPECT_EQ(server_->members(), 0u);
  now_ += seconds(17);
  auto later = make(2, MemberRole::kRobot);
  EXPECT_EQ(join(later).front().second.kind, NoteKind::kWelcome) << "places are free again";
}

TEST_F(IntroductionsTest, OnlyAnnouncementsArePassedOn) {
  auto core = make(1, MemberRole::kCore), robot = make(2, MemberRole::kRobot);
  join(core);
  const ParticipantPrefix own{2}, other{3};
  for (const auto& bytes : {std::vector<uint8_t>(), std::vector<uint8_t>(200, 7), AnnouncementMessage(own, other).end(),
                            AnnouncementMessage(own, own, true, true, AnnouncementMessage::kOtherWriter).end()}) {
    robot.announcement = bytes;
    EXPECT_TRUE(say(robot, NoteKind::kAnnounce).empty());
  }
  join(robot = make(2, MemberRole::kRobot));
  robot.announcement = std::vector<uint8_t>(200, 7);
  now_ += seconds(5);
  EXPECT_TRUE(say(robot, NoteKind::kAnnounce).empty()) << "a known one may send no other bytes either";
}

TEST_F(IntroductionsTest, WhoLeavesOrFallsSilentIsForgotten) {
  auto core = make(1, MemberRole::kCore), a = make(2, MemberRole::kRobot), b = make(3, MemberRole::kRobot);
  join(core);
  join(a);
  join(b);
  auto impostor = a;
  impostor.cookie = b.cookie;
  EXPECT_TRUE(say(impostor, NoteKind::kLeave).empty());
  EXPECT_EQ(server_->members(), 3u);
  EXPECT_TRUE(say(a, NoteKind::kLeave).empty());
  EXPECT_EQ(server_->members(), 2u);
  now_ += seconds(14);
  say(core, NoteKind::kAnnounce);
  EXPECT_EQ(server_->members(), 2u);
  now_ += seconds(2);
  EXPECT_EQ(told(say(core, NoteKind::kAnnounce)), Told{});
  EXPECT_EQ(server_->members(), 1u);
  EXPECT_THAT(lines_.back(), testing::HasSubstr("robot at 10.0.0.3:40000 fell silent"));
}

TEST_F(IntroductionsTest, OneAddressCannotFillIt) {
  auto core = make(1, MemberRole::kCore);
  join(core);
  NoteKind last = NoteKind::kWelcome;
  for (uint16_t port = 1; port <= 200; ++port) {
    auto many = make(2, MemberRole::kRobot);
    many.at.port = port;
    last = join(many).front().second.kind;
  }
  EXPECT_EQ(last, NoteKind::kFull);
  EXPECT_EQ(server_->members(), 129u);
  auto other = make(3, MemberRole::kRobot);
  EXPECT_EQ(told(join(other)), (Told{"1<3", "3<1"}));
}

TEST_F(IntroductionsTest, CountsAreToldToWhoAsks) {
  auto core = make(1, MemberRole::kCore), a = make(2, MemberRole::kRobot), other = make(3, MemberRole::kRobot, "attic");
  join(core);
  join(a);
  join(other);
  const auto who = make(9, MemberRole::kRobot);
  const auto answer = say(who, NoteKind::kAsk);
  ASSERT_EQ(answer.size(), 1u);
  EXPECT_EQ(answer[0].second.counts, (std::array<uint16_t, 3>{1, 1, 0}));
  EXPECT_EQ(answer[0].second.count, 3);
  EXPECT_EQ(server_->members(), 3u) << "who asks is no member";
}

TEST_F(IntroductionsTest, BytesThatAreNoNoteGetNoAnswer) {
  EXPECT_TRUE(server_->take({0x0a000001, 1, 0}, std::vector<uint8_t>(100, 7), now_).empty());
  EXPECT_TRUE(server_->take({0x0a000001, 1, 0}, {}, now_).empty());
  for (const NoteKind kind :
       {NoteKind::kWelcome, NoteKind::kCookie, NoteKind::kIntroduce, NoteKind::kFull, NoteKind::kAnswer})
    EXPECT_TRUE(say(make(1, MemberRole::kRobot), kind).empty()) << "two servers must not keep each other busy";
}

}  // namespace
}  // namespace comap
