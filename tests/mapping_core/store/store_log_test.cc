// Logs that do not end as they should: what a stopped writer leaves, and what no writer does.
#include "mapping_core/store/store_log.h"

#include <gmock/gmock.h>

#include "mapping_core/store/store_glance.h"
#include "mapping_core/store/store_survey.h"
#include "protocol/storage/database.h"
#include "tests/files/temporary_folder.h"
#include "tests/mapping_core/store/store_fixture.h"

namespace comap {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr size_t kHeadBytes = 32, kFrameBytes = 24 + kNewPageBytes;

class StoreLogTest : public StoreTest {
 protected:
  // As a killed core leaves it: nothing of ten settings is in the file itself.
  void SetUp() override {
    StoreTest::SetUp();
    ASSERT_TRUE(MapStore::open(folder_ / "core.comap", MapStore::Mode::kCreateOrOpen));  // closed: its tables are there
    auto store = MapStore::open(folder_ / "core.comap", MapStore::Mode::kCreateOrOpen);
    ASSERT_TRUE(store);
    for (int i = 0; i < 10; ++i) ASSERT_TRUE(store->setMeta("key" + std::to_string(i), std::string(5000, 'v')));
    whole_ = contentOf(folder_ / "core.comap-wal");
    ASSERT_EQ((whole_.size() - kHeadBytes) % kFrameBytes, 0u);
    std::ofstream(path_, std::ios::binary) << contentOf(folder_ / "core.comap");
  }
  size_t frames() const { return (whole_.size() - kHeadBytes) / kFrameBytes; }
  LogEnd look(const std::string& log) {
    for (const char* part : {"-wal", "-shm"}) std::filesystem::remove(path_.string() + part);
    std::ofstream(path_.string() + "-wal", std::ios::binary) << log;
    return lookAtLog(path_);
  }
  size_t settings() {
    const auto store = read();
    size_t found = 0;
    for (int i = 0; i < 10; ++i) found += store && !store->meta("key" + std::to_string(i))->empty();
    return found;
  }
  static size_t placeOf(size_t frame) { return kHeadBytes + frame * kFrameBytes; }
  std::string whole_;
};

TEST_F(StoreLogTest, AWholeOneEndsAsItShould) {
  for (const std::string& log : {whole_, std::string(), whole_.substr(0, placeOf(frames() / 2))}) {
    const LogEnd end = look(log);
    EXPECT_EQ(end.remark, "");
    EXPECT_EQ(end.damage, "");
  }
  look(whole_);
  EXPECT_EQ(settings(), 10u);
  std::filesystem::remove(path_.string() + "-wal");
  EXPECT_EQ(lookAtLog(path_).damage, "") << "there need not be any";
}

// The file does not shrink when it is begun anew.
TEST_F(StoreLogTest, WhatIsLeftOfAnEarlierRoundIsNothing) {
  auto store = MapStore::open(folder_ / "core.comap", MapStore::Mode::kCreateOrOpen);
  ASSERT_TRUE(store);
  {
    auto database = Database::open((folder_ / "core.comap").string(), SQLITE_OPEN_READWRITE);
    ASSERT_TRUE(store->setMeta("a", std::string(300000, 'b')));
    ASSERT_TRUE(database->execute("PRAGMA wal_checkpoint(RESTART)"));
    ASSERT_TRUE(store->setMeta("a", "c"));
  }
  const std::string log = contentOf(folder_ / "core.comap-wal");
  ASSERT_GT(log.size(), placeOf(15));
  const LogEnd end = look(log);
  EXPECT_EQ(end.remark, "");
  EXPECT_EQ(end.damage, "");
}

TEST_F(StoreLogTest, AChangeThatWasBeingWrittenIsRemarked) {
  for (const size_t cut : {whole_.size() - 1, whole_.size() - 4000, placeOf(frames() / 2) + 500}) {
    const LogEnd end = look(whole_.substr(0, cut));
    EXPECT_THAT(end.remark, HasSubstr("its writer was stopped within a change"));
    EXPECT_EQ(end.damage, "");
  }
  std::string torn = whole_;
  torn[whole_.size() - 100] = static_cast<char>(torn[whole_.size() - 100] ^ 1);
  EXPECT_THAT(look(torn).remark, HasSubstr("ends early, after " + std::to_string(frames() - 1) + " of " +
                                           std::to_string(frames()) + " pages"));
  EXPECT_EQ(settings(), 9u);
  EXPECT_THAT(surveyStore(path_)->remarks, Contains(HasSubstr("ends early")));
  EXPECT_THAT(surveyStore(path_)->damage, IsEmpty());
  EXPECT_THAT(glanceAtStore(path_)->remarks, Contains(HasSubstr("ends early")));
}

TEST_F(StoreLogTest, ChangesThatArePassedOverAreDamage) {
  for (const size_t at : {placeOf(3) + 24 + 700, placeOf(3) + 4, placeOf(3) + 17}) {
    std::string damaged = whole_;
    damaged[at] = static_cast<char>(damaged[at] ^ 4);
    EXPECT_THAT(look(damaged).damage, HasSubstr("finished changes behind it are passed over")) << at;
    EXPECT_LT(settings(), 3u);
    EXPECT_THAT(surveyStore(path_)->damage, Contains(HasSubstr("passed over")));
    EXPECT_THAT(glanceAtStore(path_)->damage, Contains(HasSubstr("passed over")));
  }
  std::string damaged = whole_;
  damaged[20] = static_cast<char>(damaged[20] ^ 1);
  EXPECT_THAT(look(damaged).damage, HasSubstr("the head of its"));
  EXPECT_EQ(settings(), 0u);
}

}  // namespace
}  // namespace comap
