// Datagrams to a discovery server, each behind four bytes: who sends it, how much later, its size. The same bytes also
// as one note and as one announcement.
#include <algorithm>
#include <map>

#include "protocol/discovery/announcement.h"
#include "protocol/discovery/introductions.h"
#include "tests/fuzz/fuzz.h"

using namespace comap;

namespace {

void readOne(fuzz::Bytes bytes) {
  if (isAnnouncement(bytes)) fuzz::require(senderOf(bytes).has_value(), "an announcement has a sender");
  (void)announcedPort(bytes);
  const auto note = decodeNote(bytes);
  if (!note) return;
  const auto again = encodeNote(*note);
  fuzz::require(std::equal(again.begin(), again.end(), bytes.begin(), bytes.end()), "a note is written as it was read");
}

// Remembers the cookies, as participants do.
class Site {
 public:
  void hear(uint8_t who, std::chrono::milliseconds later, fuzz::Bytes bytes) {
    now_ += later;
    const Endpoint from{0x0a000000u + who % 8, static_cast<uint16_t>(1000 + who), 0};
    std::vector<uint8_t> datagram(bytes.begin(), bytes.end());
    auto note = decodeNote(datagram);
    const bool proven = cookies_.contains(who);
    if (note && proven && note->cookie[0] % 2 == 0) {
      note->cookie = cookies_[who];
      datagram = encodeNote(*note);
    }
    const auto sent = server_.take(from, datagram, now_);
    size_t bytes_sent = 0;
    for (const auto& [to, answer] : sent) {
      bytes_sent += answer.size();
      const auto said = decodeNote(answer);
      fuzz::require(said.has_value(), "what the server says is a note");
      if (said->kind == NoteKind::kIntroduce)
        fuzz::require(isAnnouncement(said->announcement), "only announcements are passed on");
      if (said->kind == NoteKind::kCookie) cookies_[who] = said->cookie;
    }
    fuzz::require(proven || (sent.size() <= 1 && bytes_sent <= datagram.size()),
                  "a stranger gets no more than he sent");
    fuzz::require(sent.size() <= 1 + 2 * server_.members(), "each is told once");
  }

 private:
  Introductions server_{{1}, [](const std::string&) {}};
  Introductions::Clock::time_point now_ = Introductions::Clock::time_point() + std::chrono::hours(1);
  std::map<uint8_t, Cookie> cookies_;
};

}  // namespace

COMAP_FUZZ_TARGET(bytes) {
  readOne(bytes);
  Site site;
  while (bytes.size() >= 4) {
    const size_t size = std::min<size_t>((bytes[2] | bytes[3] << 8) % 2049, bytes.size() - 4);
    readOne(bytes.subspan(4, size));
    site.hear(bytes[0], std::chrono::milliseconds(40) * bytes[1], bytes.subspan(4, size));
    bytes = bytes.subspan(4 + size);
  }
}
