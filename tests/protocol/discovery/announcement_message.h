// A participant's announcement, as RTPS has it, for tests: header, time, data with a list of parameters.
#pragma once

#include <cstdint>
#include <vector>

#include "protocol/discovery/announcement.h"

namespace comap {

class AnnouncementMessage {
 public:
  static constexpr uint16_t kDefaultUnicast = 0x31, kMetatrafficUnicast = 0x32;
  static constexpr uint32_t kUdp4 = 1, kUdp6 = 2;
  static constexpr uint32_t kAnnouncer = 0x000100c2, kOtherWriter = 0x00000102;

  /// `guid`: who is announced; `little`, `little_parameters`: the byte order of message and parameters.
  AnnouncementMessage(const ParticipantPrefix& sender, const ParticipantPrefix& guid, bool little = true,
                      bool little_parameters = true, uint32_t writer = kAnnouncer)
      : outer_little_(little), little_(little) {
    bytes_ = {'R', 'T', 'P', 'S', 2, 3, 1, 15};
    bytes_.insert(bytes_.end(), sender.begin(), sender.end());
    submessage(0x09, 8);
    zeros(8);
    submessage(0x15, 0);
    size_at_ = bytes_.size() - 2;
    put16(0);
    put16(16);
    zeros(4);
    for (const int shift : {24, 16, 8, 0}) bytes_.push_back(static_cast<uint8_t>(writer >> shift));
    zeros(8);
    little_ = little_parameters;
    bytes_.insert(bytes_.end(), {0, static_cast<uint8_t>(little_ ? 3 : 2), 0, 0});
    put16(0x50);
    put16(16);
    bytes_.insert(bytes_.end(), guid.begin(), guid.end());
    bytes_.insert(bytes_.end(), {0, 0, 1, 0xc1});
  }
  explicit AnnouncementMessage(const ParticipantPrefix& sender) : AnnouncementMessage(sender, sender) {}

  AnnouncementMessage& locator(uint16_t parameter, uint32_t kind, uint32_t port) {
    put16(parameter);
    put16(24);
    put32(kind);
    put32(port);
    zeros(16);
    return *this;
  }
  std::vector<uint8_t> end() {
    put16(1);
    put16(0);
    const size_t size = bytes_.size() - size_at_ - 2;
    bytes_[size_at_] = static_cast<uint8_t>(outer_little_ ? size & 255 : size >> 8);
    bytes_[size_at_ + 1] = static_cast<uint8_t>(outer_little_ ? size >> 8 : size & 255);
    return bytes_;
  }

 private:
  void submessage(uint8_t kind, uint16_t size) {
    bytes_.insert(bytes_.end(), {kind, static_cast<uint8_t>((little_ ? 1 : 0) | 4)});
    put16(size);
  }
  void zeros(size_t count) { bytes_.resize(bytes_.size() + count); }
  void put16(uint16_t value) {
    const auto low = static_cast<uint8_t>(value), high = static_cast<uint8_t>(value >> 8);
    bytes_.insert(bytes_.end(), {little_ ? low : high, little_ ? high : low});
  }
  void put32(uint32_t value) {
    put16(static_cast<uint16_t>(little_ ? value : value >> 16));
    put16(static_cast<uint16_t>(little_ ? value >> 16 : value));
  }

  const bool outer_little_;
  bool little_;
  size_t size_at_ = 0;
  std::vector<uint8_t> bytes_;
};

}  // namespace comap
