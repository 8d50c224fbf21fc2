#include "protocol/discovery/announcement.h"

#include <algorithm>

namespace comap {
namespace {

// RTPS 2.3: 8.3.3 and 9.4 (messages), 9.6.2.2 (parameters).
constexpr size_t kHeaderBytes = 20, kSubmessageHeaderBytes = 4, kDataHeadBytes = 20;
constexpr uint8_t kData = 0x15, kLittleEndian = 1, kInlineQos = 2;
constexpr uint16_t kSentinel = 1, kMetatrafficUnicastLocator = 0x32;
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

// Of a list of parameters, the first locator of UDP over IPv4 that metatraffic goes to.
std::optional<uint16_t> portIn(std::span<const uint8_t> parameters) {
  if (parameters.size() < 4) return std::nullopt;
  const Bytes bytes(parameters, (parameters[1] & 1) != 0);
  for (size_t at = 4; at + 4 <= parameters.size();) {
    const uint16_t parameter = bytes.number16(at), size = bytes.number16(at + 2);
    if (parameter == kSentinel) return std::nullopt;
    const uint32_t port = bytes.number32(at + 8);
    if (parameter == kMetatrafficUnicastLocator && bytes.number32(at + 4) == kUdp4 && port > 0 && port <= 65535)
      return static_cast<uint16_t>(port);
    at += 4 + size;
  }
  return std::nullopt;
}

}  // namespace

std::optional<ParticipantPrefix> senderOf(std::span<const uint8_t> message) {
  constexpr std::array<uint8_t, 4> kRtps{'R', 'T', 'P', 'S'};
  if (message.size() < kHeaderBytes || !std::equal(kRtps.begin(), kRtps.end(), message.begin())) return std::nullopt;
  ParticipantPrefix prefix{};
  std::copy_n(message.begin() + 8, prefix.size(), prefix.begin());
  return prefix;
}

std::optional<uint16_t> announcedPort(std::span<const uint8_t> message) {
  if (!senderOf(message)) return std::nullopt;
  for (size_t at = kHeaderBytes; at + kSubmessageHeaderBytes <= message.size();) {
    const uint8_t kind = message[at], flags = message[at + 1];
    const Bytes bytes(message, (flags & kLittleEndian) != 0);
    size_t size = bytes.number16(at + 2);
    at += kSubmessageHeaderBytes;
    if (size == 0) size = message.size() - at;  // the last one may say so
    if (size > message.size() - at) return std::nullopt;
    if (kind == kData && size > kDataHeadBytes && (flags & kInlineQos) == 0) {
      const size_t content = 4u + bytes.number16(at + 2);
      if (content > size) return std::nullopt;
      if (const auto port = portIn(message.subspan(at + content, size - content))) return port;
    }
    at += size;
  }
  return std::nullopt;
}

}  // namespace comap
