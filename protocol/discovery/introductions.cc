#include "protocol/discovery/introductions.h"

#include <algorithm>

#include "protocol/keys/digest.h"

namespace comap {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr seconds kSilent{15};  // DDS announces each 2 s, and forgets after 10 s
constexpr milliseconds kLeastGap{100};
constexpr size_t kMostMembers = 4096, kMostOfSite = 512, kMostOfAddress = 128;

bool speak(MemberRole a, MemberRole b) { return a != b || a == MemberRole::kCore; }

// Introductions are datagrams that may be lost, and peers that were out of reach for long forget each other: all is
// told again, the slower the more there are, so that a server sends some ten datagrams a member and second at most.
milliseconds tellAgainAfter(size_t members) { return std::max(milliseconds(2000), milliseconds(100 * members)); }

std::string nameOf(MemberRole role) {
  return role == MemberRole::kRobot ? "robot" : role == MemberRole::kCore ? "core" : "observer";
}

}  // namespace

template <class Visit>
void Introductions::forSite(const SiteCode& site, Visit visit) const {
  for (auto it = members_.lower_bound({site, Endpoint{}}); it != members_.end() && it->first.first == site; ++it)
    visit(it->first.second, it->second);
}

std::vector<Introductions::Outgoing> Introductions::take(const Endpoint& from, std::span<const uint8_t> bytes,
                                                         Clock::time_point now) {
  forgetSilent(now);
  const auto note = decodeNote(bytes);
  if (!note) return {};
  if (note->kind == NoteKind::kAsk) {
    auto reply = answer(note->site);
    if (reply.size() > bytes.size()) return {};
    return {{from, std::move(reply)}};
  }
  if (note->kind != NoteKind::kAnnounce && note->kind != NoteKind::kLeave) return {};
  if (note->cookie != cookieOf(from, note->site)) {
    if (note->kind == NoteKind::kLeave) return {};
    Note reply;
    reply.kind = NoteKind::kCookie;
    reply.cookie = cookieOf(from, note->site);
    reply.site = note->site;
    return {{from, encodeNote(reply)}};
  }
  if (note->kind == NoteKind::kAnnounce) return announce(from, *note, now);
  if (members_.erase({note->site, from}) > 0) tell_(nameOf(note->role) + " at " + toString(from) + " left");
  return {};
}

std::vector<Introductions::Outgoing> Introductions::announce(const Endpoint& from, const Note& note,
                                                             Clock::time_point now) {
  const Key key{note.site, from};
  auto it = members_.find(key);
  const bool is_new = it == members_.end();
  Note reply;
  reply.site = note.site;
  if (is_new && !isRoomFor(from, note.site)) {
    reply.kind = NoteKind::kFull;
    return {{from, encodeNote(reply)}};
  }
  if (is_new) it = members_.emplace(key, Member{note.role, {}, now, {}}).first;
  Member& member = it->second;
  member.heard = now;
  const bool changed = member.announcement != note.announcement || member.role != note.role;
  member.announcement = note.announcement;
  member.role = note.role;

  std::vector<Outgoing> out;
  size_t of_site = 0;
  forSite(note.site, [&](const Endpoint&, const Member&) { ++of_site; });
  reply.kind = NoteKind::kWelcome;
  reply.count = static_cast<uint16_t>(of_site - 1);
  out.push_back({from, encodeNote(reply)});
  if (is_new) {
    tell_(nameOf(note.role) + " at " + toString(from) + " came; " + std::to_string(of_site) + " of its site");
    Note introduction = reply;
    introduction.kind = NoteKind::kIntroduce;
    forSite(note.site, [&](const Endpoint& other, const Member& there) {
      if (other == from || !speak(there.role, member.role)) return;
      introduction.role = there.role;
      introduction.announcement = there.announcement;
      out.push_back({from, encodeNote(introduction)});
    });
  }
  const auto since = now - member.told;
  if (is_new || (changed && since >= kLeastGap) || since >= tellAgainAfter(of_site)) {
    member.told = now;
    for (Outgoing& each : introduce(key, member)) out.push_back(std::move(each));
  }
  return out;
}

std::vector<Introductions::Outgoing> Introductions::introduce(const Key& who, const Member& member) const {
  Note note;
  note.kind = NoteKind::kIntroduce;
  note.role = member.role;
  note.site = who.first;
  note.announcement = member.announcement;
  const auto bytes = encodeNote(note);
  std::vector<Outgoing> out;
  forSite(who.first, [&](const Endpoint& other, const Member& there) {
    if (other != who.second && speak(there.role, member.role)) out.push_back({other, bytes});
  });
  return out;
}

std::vector<uint8_t> Introductions::answer(const SiteCode& site) const {
  Note note;
  note.kind = NoteKind::kAnswer;
  note.site = site;
  note.count = static_cast<uint16_t>(members_.size());
  forSite(site, [&](const Endpoint&, const Member& member) { ++note.counts.at(static_cast<size_t>(member.role)); });
  return encodeNote(note);
}

Cookie Introductions::cookieOf(const Endpoint& endpoint, const SiteCode& site) const {
  std::vector<uint8_t> text(site.begin(), site.end());
  for (const int shift : {24, 16, 8, 0}) text.push_back(static_cast<uint8_t>(endpoint.address >> shift));
  for (const int shift : {8, 0}) text.push_back(static_cast<uint8_t>(endpoint.port >> shift));
  return authenticationCode(secret_, text);
}

bool Introductions::isRoomFor(const Endpoint& from, const SiteCode& site) const {
  size_t of_site = 0;
  forSite(site, [&](const Endpoint&, const Member&) { ++of_site; });
  const auto of_address = std::count_if(members_.begin(), members_.end(),
                                        [&](const auto& entry) { return entry.first.second.address == from.address; });
  return members_.size() < kMostMembers && of_site < kMostOfSite && static_cast<size_t>(of_address) < kMostOfAddress;
}

void Introductions::forgetSilent(Clock::time_point now) {
  if (now - looked_ < seconds(1)) return;
  looked_ = now;
  for (auto it = members_.begin(); it != members_.end();) {
    if (now - it->second.heard <= kSilent) {
      ++it;
      continue;
    }
    tell_(nameOf(it->second.role) + " at " + toString(it->first.second) + " fell silent");
    it = members_.erase(it);
  }
}

}  // namespace comap
