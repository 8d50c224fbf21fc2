#include "protocol/discovery/discovery_ask.h"

#include "protocol/discovery/endpoint.h"
#include "protocol/discovery/note.h"

namespace comap {

Result<DiscoveryCounts> askDiscovery(const std::string& server, int domain, const std::string& site,
                                     std::chrono::milliseconds timeout) {
  constexpr int kTries = 4;
  const auto parsed = parseHostPort(server, "discovery server");
  if (!parsed) return parsed.error();
  const auto address = resolve(parsed->host);
  if (!address) return Error{ErrorCode::kUnreachable, "discovery server " + server + ": no such name"};
  const Endpoint there{*address, parsed->port, 0};
  const auto socket = DatagramSocket::bind({});
  if (!socket) return socket.error();
  Note question;
  question.kind = NoteKind::kAsk;
  question.site = siteCode(domain, site);
  for (int i = 0; i < kTries; ++i) {
    socket->send(there, encodeNote(question));
    const auto until = std::chrono::steady_clock::now() + timeout / kTries;
    for (auto now = std::chrono::steady_clock::now(); now < until; now = std::chrono::steady_clock::now()) {
      Endpoint from;
      const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(until - now);
      const auto bytes = socket->receive(left + std::chrono::milliseconds(1), from);
      const auto note = bytes && isSameHostPort(from, there) ? decodeNote(*bytes) : std::nullopt;
      if (note && note->kind == NoteKind::kAnswer && note->site == question.site)
        return DiscoveryCounts{note->counts[0], note->counts[1], note->counts[2], note->count};
    }
  }
  return Error{ErrorCode::kUnreachable, "no discovery server answers at " + toString(there)};
}

}  // namespace comap
