#include "protocol/discovery/introductions.h"

#include <algorithm>

#include "protocol/discovery/announcement.h"
#include "protocol/keys/digest.h"

namespace comap {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr seconds kSilent{15};  // DDS announces each 2 s, and forgets after 10 s
constexpr size_t kMostMembers = 4096, kMostOfSite = 512, kMostOfAddress = 128;

bool speak(MemberRole a, MemberRole b) { return a != b || a == MemberRole::kCore; }

// Introductions are datagrams that may be lost, and peers that were out of reach for long forget each other: all is
// told again, the slower the more there are, so that a server sends some ten datagrams a member and second at most.
milliseconds tellAgainAfter(size_t members) { return std::max(milliseconds(2000), milliseconds(100 * members)); }
milliseconds tellNewsAfter(size_t members) { return tellAgainAfter(members) / 4; }

std::string nameOf(MemberRole role) {
  return role == MemberRole::kRobot ? "robot" : role == MemberRole::kCore ? "core" : "observer";
}

}  // namespace

template <class Visit>
void Introductions::forSite(const SiteCode& site, Visit visit) const {
  for (auto it = members_.lower_bound({site, Endpoint{}}); it != members_.end() && it->first.first == site; ++it)
    if (!it->second.gone) visit(it->first.second, it->second);
}

size_t Introductions::members() const {
  return static_cast<size_t>(
      std::count_if(members_.begin(), members_.end(), [](const auto& entry) { return !entry.second.gone; }));
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
  if (note->kind == NoteKind::kAnnounce && !isAnnouncement(note->announcement)) return {};
  if (note->cookie != cookieOf(from, note->site)) {
    if (note->kind == NoteKind::kLeave) return {};
    Note reply;
    reply.kind = NoteKind::kCookie;
    reply.cookie = cookieOf(from, note->site);
    reply.site = note->site;
    return {{from, encodeNote(reply)}};
  }
  if (note->kind == NoteKind::kAnnounce) return announce(from, *note, now);
  leave({note->site, from}, now);
  return {};
}

void Introductions::leave(const Key& who, Clock::time_point now) {
  const auto it = members_.find(who);
  if (it == members_.end() || it->second.gone) return;
  it->second.gone = true;
  it->second.heard = now;
  tell_(nameOf(it->second.role) + " at " + toString(who.second) + " left");
}

std::vector<Introductions::Outgoing> Introductions::announce(const Endpoint& from, const Note& note,
                                                             Clock::time_point now) {
  const Key key{note.site, from};
  size_t others = 0;
  forSite(note.site, [&](const Endpoint& other, const Member&) { others += other != from ? 1 : 0; });
  const size_t of_site = others + 1;
  auto it = members_.find(key);
  const bool is_new = it == members_.end() || it->second.gone;
  if (is_new && it != members_.end() && now - it->second.told < tellAgainAfter(of_site)) return {};  // it says so again
  Note reply;
  reply.site = note.site;
  if (it == members_.end() && !isRoomFor(from, note.site)) {
    reply.kind = NoteKind::kFull;
    return {{from, encodeNote(reply)}};
  }
  if (it == members_.end()) it = members_.emplace(key, Member{note.role, {}, now, {}}).first;
  Member& member = it->second;
  member.gone = false;
  member.heard = now;
  member.news = member.news || member.announcement != note.announcement || member.role != note.role;
  member.announcement = note.announcement;
  member.role = note.role;

  std::vector<Outgoing> out;
  reply.kind = NoteKind::kWelcome;
  reply.count = static_cast<uint16_t>(others);
  out.push_back({from, encodeNote(reply)});
  if (is_new) {
    tell_(nameOf(note.role) + " at " + toString(from) + " came; " + std::to_string(of_site) + " of its site");
    forSite(note.site, [&](const Endpoint& other, const Member& there) {
      if (other != from && speak(there.role, member.role)) out.push_back({from, introductionOf(note.site, there)});
    });
  }
  const auto since = now - member.told;
  if (is_new || (member.news && since >= tellNewsAfter(of_site)) || since >= tellAgainAfter(of_site)) {
    member.told = now;
    member.news = false;
    for (Outgoing& each : introduce(key, member)) out.push_back(std::move(each));
  }
  return out;
}

std::vector<Introductions::Outgoing> Introductions::introduce(const Key& who, const Member& member) const {
  const auto bytes = introductionOf(who.first, member);
  std::vector<Outgoing> out;
  forSite(who.first, [&](const Endpoint& other, const Member& there) {
    if (other != who.second && speak(there.role, member.role)) out.push_back({other, bytes});
  });
  return out;
}

std::vector<uint8_t> Introductions::introductionOf(const SiteCode& site, const Member& member) {
  Note note;
  note.kind = NoteKind::kIntroduce;
  note.role = member.role;
  note.site = site;
  note.announcement = member.announcement;
  return encodeNote(note);
}

std::vector<uint8_t> Introductions::answer(const SiteCode& site) const {
  Note note;
  note.kind = NoteKind::kAnswer;
  note.site = site;
  note.count = static_cast<uint16_t>(members());
  forSite(site, [&](const Endpoint&, const Member& member) { ++note.counts.at(static_cast<size_t>(member.role)); });
  return encodeNote(note);
}

Cookie Introductions::cookieOf(const Endpoint& endpoint, const SiteCode& site) const {
  std::vector<uint8_t> text(site.begin(), site.end());
  for (const int shift : {24, 16, 8, 0}) text.push_back(static_cast<uint8_t>(endpoint.address >> shift));
  for (const int shift : {8, 0}) text.push_back(static_cast<uint8_t>(endpoint.port >> shift));
  return authenticationCode(secret_, text);
}

// Places of those who have left count too.
bool Introductions::isRoomFor(const Endpoint& from, const SiteCode& site) const {
  const auto of_site = std::count_if(members_.lower_bound({site, Endpoint{}}), members_.end(),
                                     [&](const auto& entry) { return entry.first.first == site; });
  const auto of_address = std::count_if(members_.begin(), members_.end(),
                                        [&](const auto& entry) { return entry.first.second.address == from.address; });
  return members_.size() < kMostMembers && static_cast<size_t>(of_site) < kMostOfSite &&
         static_cast<size_t>(of_address) < kMostOfAddress;
}

void Introductions::forgetSilent(Clock::time_point now) {
  if (now - looked_ < seconds(1)) return;
  looked_ = now;
  for (auto it = members_.begin(); it != members_.end();) {
    if (now - it->second.heard <= kSilent) {
      ++it;
      continue;
    }
    if (!it->second.gone) tell_(nameOf(it->second.role) + " at " + toString(it->first.second) + " fell silent");
    it = members_.erase(it);
  }
}

}  // namespace comap
