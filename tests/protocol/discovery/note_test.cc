#include "protocol/discovery/note.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

Note filled() {
  Note note;
  note.kind = NoteKind::kAnswer;
  note.role = MemberRole::kObserver;
  note.count = 0x1234;
  note.counts = {1, 0xfffe, 3};
  note.cookie = {9, 8, 7};
  note.site = siteCode(42, "flat");
  note.announcement = {1, 2, 3, 4, 5};
  return note;
}

TEST(Note, ComesBackAsItWent) {
  const Note note = filled();
  const auto back = decodeNote(encodeNote(note));
  ASSERT_TRUE(back);
  EXPECT_EQ(back->kind, note.kind);
  EXPECT_EQ(back->role, note.role);
  EXPECT_EQ(back->count, note.count);
  EXPECT_EQ(back->counts, note.counts);
  EXPECT_EQ(back->cookie, note.cookie);
  EXPECT_EQ(back->site, note.site);
  EXPECT_EQ(back->announcement, note.announcement);
}

TEST(Note, OtherBytesAreNone) {
  const auto good = encodeNote(filled());
  const size_t head = good.size() - filled().announcement.size();
  for (size_t size = 0; size < head; ++size)
    EXPECT_FALSE(decodeNote(std::span(good).first(size))) << size << " of " << head << " bytes";
  for (const auto& [at, value] :
       {std::pair(0, 'X'), std::pair(5, '\2'), std::pair(6, '\0'), std::pair(6, '\x9'), std::pair(7, '\3')}) {
    auto bad = good;
    bad.at(static_cast<size_t>(at)) = static_cast<uint8_t>(value);
    EXPECT_FALSE(decodeNote(bad)) << "byte " << at << " as " << int{value};
  }
  auto large = good;
  large.resize(head + kMostAnnouncementBytes);
  EXPECT_TRUE(decodeNote(large));
  large.push_back(0);
  EXPECT_FALSE(decodeNote(large));
}

TEST(Note, SitesAndDomainsAreToldApart) {
  EXPECT_EQ(siteCode(42, "flat"), siteCode(42, "flat"));
  EXPECT_NE(siteCode(42, "flat"), siteCode(42, "flat2"));
  EXPECT_NE(siteCode(4, "2/flat"), siteCode(42, "flat"));
  EXPECT_NE(siteCode(43, "flat"), siteCode(42, "flat"));
}

}  // namespace
}  // namespace comap
