// What participants and the discovery server write to each other, a datagram each (docs/wire.md, "Discovery server").
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace comap {

enum class NoteKind : uint8_t {
  kAnnounce = 1,  ///< participant to server: I am here, this is what DDS says of me
  kCookie,        ///< server: say it again with this, so that I know that you get what I send to you
  kWelcome,       ///< server: taken; `count` others of the site are there
  kIntroduce,     ///< server: another of the site says this of itself
  kFull,          ///< server: no room for you now
  kLeave,         ///< participant: forget me
  kAsk,           ///< anyone: how many are there?
  kAnswer,        ///< server: `counts` of the site, `count` in all
};

/// Two that only listen, or two robots, have nothing to say to each other and are not introduced.
enum class MemberRole : uint8_t { kRobot, kCore, kObserver };

using Cookie = std::array<uint8_t, 16>;
/// Stands for a DDS domain and a site: a hash, so who does not know the site's name has to guess it.
using SiteCode = std::array<uint8_t, 16>;
SiteCode siteCode(int domain, const std::string& site);

struct Note {
  NoteKind kind = NoteKind::kAnnounce;
  MemberRole role = MemberRole::kRobot;
  uint16_t count = 0;
  std::array<uint16_t, 3> counts{};  ///< by role
  Cookie cookie{};
  SiteCode site{};
  std::vector<uint8_t> announcement;  ///< as DDS made it
};

inline constexpr size_t kMostAnnouncementBytes = 1400;

std::vector<uint8_t> encodeNote(const Note& note);
/// Nothing for bytes that are no note of this version.
std::optional<Note> decodeNote(std::span<const uint8_t> bytes);

}  // namespace comap
