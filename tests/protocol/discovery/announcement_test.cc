#include "protocol/discovery/announcement.h"

#include <gtest/gtest.h>

#include "tests/protocol/discovery/announcement_message.h"

namespace comap {
namespace {

using Message = AnnouncementMessage;

constexpr ParticipantPrefix kSender{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};

std::vector<uint8_t> whole() {
  return Message(kSender).locator(Message::kMetatrafficUnicast, Message::kUdp4, 17910).end();
}

TEST(Announcement, SaysOnWhichPortToAnswer) {
  for (const bool little : {true, false})
    for (const bool little_parameters : {true, false}) {
      const auto message = Message(kSender, kSender, little, little_parameters)
                               .locator(Message::kDefaultUnicast, Message::kUdp4, 1111)
                               .locator(Message::kMetatrafficUnicast, Message::kUdp6, 2222)
                               .locator(Message::kMetatrafficUnicast, Message::kUdp4, 17910)
                               .locator(Message::kMetatrafficUnicast, Message::kUdp4, 17912)
                               .end();
      EXPECT_EQ(announcedPort(message), 17910) << little << little_parameters;
      EXPECT_EQ(senderOf(message), kSender);
      EXPECT_TRUE(isAnnouncement(message)) << little << little_parameters;
    }
}

TEST(Announcement, WithoutAPortSaysNone) {
  EXPECT_FALSE(announcedPort(Message(kSender).locator(Message::kDefaultUnicast, Message::kUdp4, 1111).end()));
  EXPECT_FALSE(announcedPort(Message(kSender).locator(Message::kMetatrafficUnicast, Message::kUdp4, 70000).end()));
  EXPECT_FALSE(announcedPort(Message(kSender).locator(Message::kMetatrafficUnicast, Message::kUdp4, 0).end()));
}

TEST(Announcement, IsOfItsSenderAndNothingElse) {
  ParticipantPrefix other = kSender;
  other[11] = 0;
  EXPECT_FALSE(isAnnouncement(Message(kSender, other).end())) << "in the name of another";
  EXPECT_FALSE(isAnnouncement(Message(kSender, kSender, true, true, Message::kOtherWriter).end())) << "other data";
  constexpr size_t kDataAt = 20 + 12;
  auto message = whole();
  ASSERT_EQ(message[kDataAt], 0x15);
  message[kDataAt + 1] = 1 | 8;
  EXPECT_FALSE(isAnnouncement(message)) << "a key alone";
  message = whole();
  const std::vector<uint8_t> data(message.begin() + kDataAt, message.end());
  message.insert(message.end(), data.begin(), data.end());
  EXPECT_FALSE(isAnnouncement(message)) << "two";
  for (const int kind : {0x02, 0x06, 0x07, 0x08, 0x0f, 0x12, 0x16, 0x30, 0x81}) {
    message = whole();
    message.insert(message.end(), {static_cast<uint8_t>(kind), 1, 4, 0, 0, 0, 0, 0});
    EXPECT_FALSE(isAnnouncement(message)) << "submessage " << kind;
    EXPECT_FALSE(announcedPort(message)) << "submessage " << kind;
  }
  message = whole();
  message.insert(message.end(), {0x01, 1, 0, 0});
  EXPECT_TRUE(isAnnouncement(message)) << "padding";
  message = whole();
  message.insert(message.end(), {0x80, 1, 4, 0, 0, 0, 0, 0});
  EXPECT_TRUE(isAnnouncement(message)) << "Fast DDS counts packets";
  message = whole();
  message.resize(kDataAt);
  EXPECT_FALSE(isAnnouncement(message)) << "no data";
}

// As of a process's second participant: Fast DDS then says its key and its state once more.
TEST(Announcement, MayHaveInlineQosUnlessThatSaysGoodBye) {
  constexpr size_t kDataAt = 20 + 12, kContentAt = kDataAt + 4 + 20;
  const auto withStatus = [](uint8_t status, uint8_t end) {
    auto message = whole();
    message[kDataAt + 1] |= 2;
    const std::vector<uint8_t> qos{0x70, 0, 4, 0, 1, 2, 3, 4, 0x71, 0, 4, 0, 0, 0, 0, status, end, 0, 0, 0};
    message.insert(message.begin() + kContentAt, qos.begin(), qos.end());
    message[kDataAt + 2] = static_cast<uint8_t>(message[kDataAt + 2] + qos.size());
    return message;
  };
  EXPECT_TRUE(isAnnouncement(withStatus(0, 1)));
  EXPECT_EQ(announcedPort(withStatus(0, 1)), 17910);
  for (const int gone : {1, 2, 3}) EXPECT_FALSE(isAnnouncement(withStatus(static_cast<uint8_t>(gone), 1))) << gone;
  EXPECT_FALSE(isAnnouncement(withStatus(0, 0x70))) << "it does not end";
}

TEST(Announcement, CutOrChangedNeverGivesAPortThatIsNotThere) {
  const auto message = whole();
  for (size_t size = 0; size < message.size(); ++size) {
    const std::vector<uint8_t> cut(message.begin(), message.begin() + static_cast<ptrdiff_t>(size));
    EXPECT_FALSE(announcedPort(cut)) << "the data submessage is longer than what is left of it: " << size;
    EXPECT_FALSE(isAnnouncement(cut)) << size;
  }
  auto other = message;
  other[0] = 'X';
  EXPECT_FALSE(announcedPort(other));
  EXPECT_FALSE(senderOf(other));
  EXPECT_FALSE(isAnnouncement(other));
  for (size_t at = 20; at < message.size(); ++at)
    for (const int value : {0, 1, 127, 255}) {
      auto changed = message;
      changed[at] = static_cast<uint8_t>(value);
      static_cast<void>(announcedPort(changed));  // ends, and reads nothing beyond: the sanitizer build watches
      static_cast<void>(isAnnouncement(changed));
    }
}

}  // namespace
}  // namespace comap
