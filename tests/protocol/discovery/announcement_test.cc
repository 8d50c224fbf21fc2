#include "protocol/discovery/announcement.h"

#include <gtest/gtest.h>

#include <vector>

namespace comap {
namespace {

// A participant's announcement, as RTPS has it: header, time, data with a list of parameters.
class Message {
 public:
  Message(bool little, bool little_parameters) : little_(little) {
    bytes_ = {'R', 'T', 'P', 'S', 2, 3, 1, 15, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};
    submessage(0x09, 8);
    bytes_.resize(bytes_.size() + 8);
    submessage(0x15, 0);
    size_at_ = bytes_.size() - 2;
    put16(0);
    put16(16);
    bytes_.resize(bytes_.size() + 16);
    little_ = little_parameters;
    bytes_.insert(bytes_.end(), {0, static_cast<uint8_t>(little_ ? 3 : 2), 0, 0});
  }
  Message& locator(uint16_t parameter, uint32_t kind, uint32_t port) {
    put16(parameter);
    put16(24);
    put32(kind);
    put32(port);
    bytes_.resize(bytes_.size() + 16);
    return *this;
  }
  std::vector<uint8_t> end(bool little) {
    put16(1);
    put16(0);
    const size_t size = bytes_.size() - size_at_ - 2;
    bytes_[size_at_] = static_cast<uint8_t>(little ? size & 255 : size >> 8);
    bytes_[size_at_ + 1] = static_cast<uint8_t>(little ? size >> 8 : size & 255);
    return bytes_;
  }

 private:
  void submessage(uint8_t kind, uint16_t size) {
    bytes_.insert(bytes_.end(), {kind, static_cast<uint8_t>((little_ ? 1 : 0) | 4)});
    put16(size);
  }
  void put16(uint16_t value) {
    const auto low = static_cast<uint8_t>(value), high = static_cast<uint8_t>(value >> 8);
    bytes_.insert(bytes_.end(), {little_ ? low : high, little_ ? high : low});
  }
  void put32(uint32_t value) {
    put16(static_cast<uint16_t>(little_ ? value : value >> 16));
    put16(static_cast<uint16_t>(little_ ? value >> 16 : value));
  }

  bool little_;
  size_t size_at_ = 0;
  std::vector<uint8_t> bytes_;
};

constexpr uint16_t kDefaultUnicast = 0x31, kMetatrafficUnicast = 0x32;
constexpr uint32_t kUdp4 = 1, kUdp6 = 2;

TEST(Announcement, SaysOnWhichPortToAnswer) {
  for (const bool little : {true, false})
    for (const bool little_parameters : {true, false}) {
      const auto message = Message(little, little_parameters)
                               .locator(kDefaultUnicast, kUdp4, 1111)
                               .locator(kMetatrafficUnicast, kUdp6, 2222)
                               .locator(kMetatrafficUnicast, kUdp4, 17910)
                               .locator(kMetatrafficUnicast, kUdp4, 17912)
                               .end(little);
      EXPECT_EQ(announcedPort(message), 17910) << little << little_parameters;
      EXPECT_EQ(senderOf(message), (ParticipantPrefix{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}));
    }
}

TEST(Announcement, WithoutAPortSaysNone) {
  EXPECT_FALSE(announcedPort(Message(true, true).locator(kDefaultUnicast, kUdp4, 1111).end(true)));
  EXPECT_FALSE(announcedPort(Message(true, true).locator(kMetatrafficUnicast, kUdp4, 70000).end(true)));
  EXPECT_FALSE(announcedPort(Message(true, true).locator(kMetatrafficUnicast, kUdp4, 0).end(true)));
}

TEST(Announcement, CutOrChangedNeverGivesAPortThatIsNotThere) {
  const auto whole = Message(true, true).locator(kMetatrafficUnicast, kUdp4, 17910).end(true);
  int without = 0;
  for (size_t size = 0; size < whole.size(); ++size) {
    const auto port = announcedPort(std::span(whole).first(size));
    without += port ? 0 : 1;
    EXPECT_TRUE(!port || *port == 17910) << size;
  }
  EXPECT_EQ(without, static_cast<int>(whole.size())) << "the data submessage is longer than what is left of it";
  auto other = whole;
  other[0] = 'X';
  EXPECT_FALSE(announcedPort(other));
  EXPECT_FALSE(senderOf(other));
  for (size_t at = 20; at < whole.size(); ++at)
    for (const int value : {0, 1, 127, 255}) {
      auto changed = whole;
      changed[at] = static_cast<uint8_t>(value);
      static_cast<void>(announcedPort(changed));  // ends, and reads nothing beyond: the sanitizer build watches
    }
}

}  // namespace
}  // namespace comap
