#include "protocol/discovery/note.h"

#include <algorithm>

#include "protocol/keys/digest.h"

namespace comap {
namespace {

constexpr std::array<uint8_t, 6> kMagic{'C', 'M', 'A', 'P', 'D', 1};
constexpr size_t kHeadBytes = kMagic.size() + 2 + 4 * sizeof(uint16_t) + sizeof(Cookie) + sizeof(SiteCode);

void put(std::vector<uint8_t>& bytes, uint16_t value) {
  bytes.push_back(static_cast<uint8_t>(value & 0xff));
  bytes.push_back(static_cast<uint8_t>(value >> 8));
}

}  // namespace

SiteCode siteCode(int domain, const std::string& site) {
  const std::string text = std::to_string(domain) + "/" + site;
  constexpr std::array<uint8_t, 5> kKey{'c', 'o', 'm', 'a', 'p'};
  return authenticationCode(kKey, {reinterpret_cast<const uint8_t*>(text.data()), text.size()});
}

std::vector<uint8_t> encodeNote(const Note& note) {
  std::vector<uint8_t> bytes(kMagic.begin(), kMagic.end());
  bytes.reserve(kHeadBytes + note.announcement.size());
  bytes.push_back(static_cast<uint8_t>(note.kind));
  bytes.push_back(static_cast<uint8_t>(note.role));
  put(bytes, note.count);
  for (const uint16_t count : note.counts) put(bytes, count);
  bytes.insert(bytes.end(), note.cookie.begin(), note.cookie.end());
  bytes.insert(bytes.end(), note.site.begin(), note.site.end());
  bytes.insert(bytes.end(), note.announcement.begin(), note.announcement.end());
  return bytes;
}

std::optional<Note> decodeNote(std::span<const uint8_t> bytes) {
  if (bytes.size() < kHeadBytes || bytes.size() > kHeadBytes + kMostAnnouncementBytes ||
      !std::equal(kMagic.begin(), kMagic.end(), bytes.begin()))
    return std::nullopt;
  const uint8_t kind = bytes[kMagic.size()], role = bytes[kMagic.size() + 1];
  if (kind < static_cast<uint8_t>(NoteKind::kAnnounce) || kind > static_cast<uint8_t>(NoteKind::kAnswer) ||
      role > static_cast<uint8_t>(MemberRole::kObserver))
    return std::nullopt;
  Note note;
  note.kind = static_cast<NoteKind>(kind);
  note.role = static_cast<MemberRole>(role);
  size_t at = kMagic.size() + 2;
  const auto number = [&] {
    const auto value = static_cast<uint16_t>(bytes[at] | bytes[at + 1] << 8);
    at += sizeof value;
    return value;
  };
  note.count = number();
  for (uint16_t& count : note.counts) count = number();
  for (auto* code : {&note.cookie, &note.site}) {
    std::copy_n(bytes.begin() + static_cast<ptrdiff_t>(at), code->size(), code->begin());
    at += code->size();
  }
  note.announcement.assign(bytes.begin() + static_cast<ptrdiff_t>(at), bytes.end());
  return note;
}

}  // namespace comap
