#include "protocol/discovery/announcement.h"

#include <algorithm>

namespace comap {
namespace {

// RTPS 2.3: 8.3.3 and 9.4 (messages), 9.6.2.2 (parameters).
constexpr size_t kHeaderBytes = 20, kSubmessageHeaderBytes = 4, kDataHeadBytes = 20, kGuidBytes = 16;
constexpr uint8_t kPad = 0x01, kTime = 0x09, kDestination = 0x0e, kData = 0x15, kLittleEndian = 1, kInlineQos = 2,
                  kWithData = 4;
constexpr uint8_t kFastDdsStatistics = 0x80;  // how many packets were sent so far; behind all else
constexpr std::array<uint8_t, 4> kAnnouncer{0x00, 0x01, 0x00, 0xc2};  // what of a participant announces it
constexpr uint16_t kSentinel = 1, kMetatrafficUnicastLocator = 0x32, kParticipantGuid = 0x50, kStatusInfo = 0x71;
constexpr uint8_t kUdp4 = 1;

// Reads past the end are zero: nothing that matters is.
class Bytes {
 public:
  Bytes(std::span<const uint8_t> bytes, bool little) : bytes_(bytes), little_(little) {}
  uint8_t octet(size_t at) const { return at < bytes_.size() ? bytes_[at] : 0; }
  uint16_t number16(size_t at) const {
    return static_cast<uint16_t>(little_ ? octet(at) | octet(at + 1) << 8 : octet(at) << 8 | octet(at + 1));
  }
  uint32_t number32(size_t at) const {
    const uint32_t first = number16(at), second = number16(at + 2);
    return little_ ? first | second << 16 : first << 16 | second;
  }

 private:
  std::span<const uint8_t> bytes_;
  bool little_;
};

using Part = std::span<const uint8_t>;

// What the parameters of this number say, one after the other, until `takes` has what it wants.
template <class Takes>
void forEach(uint16_t wanted, Part parameters, Takes takes) {
  if (parameters.size() < 4) return;
  const bool little = (parameters[1] & 1) != 0;
  const Bytes bytes(parameters, little);
  for (size_t at = 4; at + 4 <= parameters.size();) {
    const uint16_t parameter = bytes.number16(at), size = bytes.number16(at + 2);
    at += 4;
    if (parameter == kSentinel || size > parameters.size() - at) return;
    if (parameter == wanted && takes(parameters.subspan(at, size), little)) return;
    at += size;
  }
}

// Behind the inline QoS that `part` begins with; nothing if it does not end, or says that the participant is gone.
std::optional<Part> behindInlineQos(Part part, bool little) {
  const Bytes bytes(part, little);
  for (size_t at = 0; at + 4 <= part.size();) {
    const uint16_t parameter = bytes.number16(at), size = bytes.number16(at + 2);
    at += 4;
    if (parameter == kSentinel) return part.subspan(at);
    if (size > part.size() - at || (parameter == kStatusInfo && (bytes.octet(at + 3) & 3) != 0)) return std::nullopt;
    at += size;
  }
  return std::nullopt;
}

// What the DATA submessage of an announcement says.
std::optional<Part> contentOf(Part data, uint8_t flags) {
  const bool little = (flags & kLittleEndian) != 0;
  if (data.size() <= kDataHeadBytes || (flags & kWithData) == 0 ||
      !std::equal(kAnnouncer.begin(), kAnnouncer.end(), data.begin() + 8))
    return std::nullopt;
  const size_t content = 4u + Bytes(data, little).number16(2);
  if (content > data.size()) return std::nullopt;
  const Part rest = data.subspan(content);
  return (flags & kInlineQos) != 0 ? behindInlineQos(rest, little) : rest;
}

// The one list of parameters of a message that holds nothing but a participant's announcement; nothing for others, as
// for one that takes leave.
std::optional<Part> parametersOf(Part message) {
  std::optional<Part> found;
  for (size_t at = kHeaderBytes; at + kSubmessageHeaderBytes <= message.size();) {
    const uint8_t kind = message[at], flags = message[at + 1];
    const Bytes bytes(message, (flags & kLittleEndian) != 0);
    size_t size = bytes.number16(at + 2);
    at += kSubmessageHeaderBytes;
    if (size == 0 && kind == kData) size = message.size() - at;  // the last one may say so
    if (size > message.size() - at) return std::nullopt;
    if (kind == kData) {
      const auto content = contentOf(message.subspan(at, size), flags);
      if (found || !content) return std::nullopt;
      found = content;
    } else if (kind != kPad && kind != kTime && kind != kDestination && kind != kFastDdsStatistics) {
      return std::nullopt;
    }
    at += size;
  }
  return found;
}

}  // namespace

std::optional<ParticipantPrefix> senderOf(std::span<const uint8_t> message) {
  constexpr std::array<uint8_t, 4> kRtps{'R', 'T', 'P', 'S'};
  if (message.size() < kHeaderBytes || !std::equal(kRtps.begin(), kRtps.end(), message.begin())) return std::nullopt;
  ParticipantPrefix prefix{};
  std::copy_n(message.begin() + 8, prefix.size(), prefix.begin());
  return prefix;
}

bool isAnnouncement(std::span<const uint8_t> message) {
  const auto sender = senderOf(message);
  const auto parameters = sender ? parametersOf(message) : std::nullopt;
  bool of_sender = false;
  if (parameters)
    forEach(kParticipantGuid, *parameters, [&](Part guid, bool) {
      of_sender = guid.size() == kGuidBytes && std::equal(sender->begin(), sender->end(), guid.begin());
      return true;
    });
  return of_sender;
}

std::optional<uint16_t> announcedPort(std::span<const uint8_t> message) {
  std::optional<uint16_t> found;
  const auto parameters = senderOf(message) ? parametersOf(message) : std::nullopt;
  if (parameters)
    forEach(kMetatrafficUnicastLocator, *parameters, [&](Part locator, bool little) {
      const Bytes bytes(locator, little);
      const uint32_t port = bytes.number32(4);
      if (bytes.number32(0) == kUdp4 && port > 0 && port <= 65535) found = static_cast<uint16_t>(port);
      return found.has_value();
    });
  return found;
}

}  // namespace comap
