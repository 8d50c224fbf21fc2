// What is saved of an outbox whose file is damaged, cut off or no outbox at all.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <fstream>

#include "edge_agent/uplink/outbox_place.h"
#include "tests/edge_agent/uplink/outbox_file.h"
#include "tests/files/damaged_database.h"

namespace comap {
namespace {

// Opens robot r's in a folder, as an agent does.
struct OptionsOf {
  explicit OptionsOf(const ScratchFolder& folder) { options.directory = folder.file(""); }
  BegunOutbox open() {
    auto begun = openOutbox(options, "r", 6, [this](const std::string& line) { log += line + "\n"; });
    EXPECT_TRUE(begun) << (begun ? "" : begun.error().text);
    return std::move(*begun);
  }
  OutboxOptions options;
  std::string log;
};

class DamagedOutbox : public OutboxFile {
 protected:
  void SetUp() override {
    auto outbox = Outbox::open(path_);
    ASSERT_TRUE(outbox);
    ASSERT_TRUE(outbox->beginSession(5));
    put(*outbox, 0, 40);
  }
  // Overwrites what is behind the first place where `text` stands.
  void overwriteBehind(const std::vector<uint8_t>& text, size_t skip, size_t bytes) {
    std::fstream file(path_, std::ios::in | std::ios::out | std::ios::binary);
    const std::vector<uint8_t> all{std::istreambuf_iterator<char>(file), {}};
    const auto at = std::search(all.begin(), all.end(), text.begin(), text.end());
    ASSERT_NE(at, all.end());
    file.clear();
    file.seekp(at - all.begin() + static_cast<std::ptrdiff_t>(skip));
    for (size_t i = 0; i < bytes; ++i) file.put('x');
  }
  Result<Outbox> reopen(const std::string& robot = "r") {
    OutboxOptions options;
    options.directory = folder_.file("");
    auto begun = openOutbox(options, robot, 6, [this](const std::string& line) { log_ += line + "\n"; });
    if (!begun) return begun.error();
    EXPECT_GE(begun->session, 6u);
    return std::move(begun->outbox);
  }
  // Of session 5, those whose message is whole.
  static std::vector<uint32_t> wholeIn(Outbox& outbox) {
    std::vector<uint32_t> sequences;
    for (const OutboxRow& row : rowsFrom(outbox))
      if (const auto bytes = outbox.encoded(row.key); bytes && decodeKeyframe(*bytes))
        sequences.push_back(row.key.sequence);
    return sequences;
  }
  // Where the sequences before each are not there, it says so.
  static void expectNoGapUntold(Outbox& outbox) {
    uint32_t next = 0;
    for (const OutboxRow& row : rowsFrom(outbox)) {
      const auto keyframe = decodeKeyframe(bytesOf(outbox, row.key));
      ASSERT_TRUE(keyframe);
      EXPECT_EQ(keyframe->skipped, row.skipped);
      EXPECT_EQ(row.key.sequence - row.skipped, next) << row.key.sequence;
      next = row.key.sequence + 1;
    }
  }
  int64_t pages() const { return static_cast<int64_t>(std::filesystem::file_size(path_)) / kDatabasePage; }
  std::string log_;
};

TEST_F(DamagedOutbox, WhatIsLostIsCounted) {
  OptionsOf options(folder_);
  EXPECT_EQ(options.open().lost, 0u) << "a whole one";
  auto seventh = messageOf(7);
  seventh.resize(60);
  overwriteBehind(seventh, 40, 20);
  wipePage(path_, rootPageOf(path_, "meta"));  // so that it is found at the start
  const BegunOutbox damaged = options.open();
  EXPECT_EQ(damaged.lost, 1u) << options.log;
  EXPECT_FALSE(damaged.more_lost);
}

TEST_F(DamagedOutbox, OfGarbageNobodyKnowsWhatIsLost) {
  std::ofstream(path_) << std::string(5000, 'x');
  OptionsOf options(folder_);
  EXPECT_TRUE(options.open().more_lost);
}

TEST_F(DamagedOutbox, AFileWithoutAByteIsTold) {
  std::ofstream(path_).flush();
  {
    OptionsOf options(folder_);
    EXPECT_FALSE(options.open().more_lost) << "as when an agent was ended at its very start";
    EXPECT_NE(options.log.find("has 0 bytes and begins anew"), std::string::npos) << options.log;
  }
  std::filesystem::resize_file(path_, 0);
  std::ofstream(path_ + "-wal") << "what SQLite would take away";
  OptionsOf options(folder_);
  EXPECT_TRUE(options.open().more_lost) << "it had a log";
  EXPECT_EQ(std::filesystem::file_size(path_ + ".damaged-1-wal"), 27u) << "kept";
}

TEST_F(DamagedOutbox, WhatIsNoFileIsNamed) {
  const auto refused = [&](const std::string& words) {
    OutboxOptions options;
    options.directory = folder_.file("");
    const auto begun = openOutbox(options, "r", 6, [](const std::string&) {});
    ASSERT_FALSE(begun);
    EXPECT_EQ(begun.error().code, ErrorCode::kUnreachable);
    EXPECT_NE(begun.error().text.find(path_ + ": is " + words), std::string::npos) << begun.error().text;
    std::filesystem::remove(path_);
  };
  std::filesystem::remove(path_);
  std::filesystem::create_directory(path_);
  refused("a folder, expected a regular file");
  std::filesystem::create_symlink("/nowhere/at/all", path_);
  refused("a link to /nowhere/at/all, which is not there");
  ASSERT_EQ(mkfifo(path_.c_str(), 0600), 0);
  refused("a named pipe, expected a regular file");
}

TEST_F(DamagedOutbox, GarbageIsPutAsideAndTold) {
  std::ofstream(path_) << std::string(5000, 'x');
  auto outbox = reopen();
  ASSERT_TRUE(outbox) << outbox.error().text;
  EXPECT_EQ(outbox->size(), 0u);
  EXPECT_TRUE(std::filesystem::exists(path_ + ".damaged-1"));
  EXPECT_NE(log_.find(path_ + ".damaged-1"), std::string::npos) << log_;
}

TEST_F(DamagedOutbox, OneDamagedKeyframeCostsThatOneAndTheChainHolds) {
  auto seventh = messageOf(7);
  seventh.resize(60);
  overwriteBehind(seventh, 40, 20);
  {
    auto outbox = reopen();
    ASSERT_TRUE(outbox) << outbox.error().text;
    const auto read = outbox->encoded({5, 7});
    ASSERT_FALSE(read);
    EXPECT_EQ(read.error().code, ErrorCode::kBadData);
  }
  auto rescued = rescueOutbox(path_);
  ASSERT_TRUE(rescued) << rescued.error().text;
  EXPECT_EQ(rescued->outbox.size(), 39u);
  ASSERT_EQ(rescued->lost.size(), 1u);
  EXPECT_EQ(rescued->lost[0].key.sequence, 7u);
  EXPECT_GT(*rescued->outbox.beginSession(1), 5u);
  const auto eighth = decodeKeyframe(bytesOf(rescued->outbox, {5, 8}));
  ASSERT_TRUE(eighth) << eighth.error().text;
  EXPECT_EQ(eighth->skipped, 1u);
  EXPECT_EQ(eighth->linked_to, 6u);
  EXPECT_NEAR(eighth->T_link_this.translation().x(), 0.2, 1e-9);
}

// As an agent does that finds the damage while it runs: what took the file's place has let go of it.
TEST_F(DamagedOutbox, IsRescuedFromUnderWhoHadItOpen) {
  auto seventh = messageOf(7);
  seventh.resize(60);
  auto outbox = reopen();
  ASSERT_TRUE(outbox) << outbox.error().text;
  overwriteBehind(seventh, 40, 20);
  auto nowhere = Outbox::inMemory();
  ASSERT_TRUE(nowhere);
  *outbox = std::move(*nowhere);
  const auto rescued = rescueOutbox(path_);
  ASSERT_TRUE(rescued) << rescued.error().text;
  EXPECT_EQ(rescued->outbox.size(), 39u);
}

// Wherever it is cut: each keyframe whose message stands before the cut is saved.
TEST_F(DamagedOutbox, AFileCutOffKeepsAllThatIsBeforeTheCut) {
  std::vector<int64_t> page_of;  // the last one of each message
  for (uint32_t i = 0; i < 40; ++i) {
    const auto message = messageOf(i);
    page_of.push_back(pageOf(path_, std::span(message).last(40)));
    ASSERT_GT(page_of.back(), 0) << i;
  }
  const std::string whole = folder_.file("whole");
  std::filesystem::copy_file(path_, whole);
  const int64_t all = pages();
  for (const int64_t cut : {all / 2, all * 3 / 4, all - 1}) {
    std::filesystem::copy_file(whole, path_, std::filesystem::copy_options::overwrite_existing);
    std::filesystem::resize_file(path_, static_cast<uintmax_t>(cut * kDatabasePage));
    auto outbox = reopen();
    ASSERT_TRUE(outbox) << outbox.error().text;
    std::vector<uint32_t> expected;
    for (uint32_t i = 0; i < 40; ++i)
      if (page_of[i] <= cut) expected.push_back(i);
    ASSERT_GT(expected.size(), 5u);
    ASSERT_LT(expected.size(), 40u);
    EXPECT_EQ(wholeIn(*outbox), expected) << cut << " of " << all << " pages\n" << log_;
    expectNoGapUntold(*outbox);
    EXPECT_NE(log_.find("places in it could not be read"), std::string::npos) << log_;
  }
  EXPECT_TRUE(std::filesystem::exists(path_ + ".damaged-3"));
}

// Each page in turn, those among them that say where others are: none takes more than the keyframes that are on it,
// which are three at most.
TEST_F(DamagedOutbox, OneDamagedPageCostsWhatIsOnItAndNoMore) {
  const std::string whole = folder_.file("whole");
  std::filesystem::copy_file(path_, whole);
  size_t lost = 0;
  for (int64_t page = 1; page <= pages(); ++page) {
    std::filesystem::copy_file(whole, path_, std::filesystem::copy_options::overwrite_existing);
    wipePage(path_, page);
    auto rescued = rescueOutbox(path_);
    ASSERT_TRUE(rescued) << rescued.error().text;
    const size_t saved = wholeIn(rescued->outbox).size();
    EXPECT_GE(saved, 37u) << "page " << page << ": " << rescued->told;
    expectNoGapUntold(rescued->outbox);
    lost += 40 - saved;
  }
  EXPECT_GE(lost, 30u) << "most stand on a page of their own";
}

TEST_F(DamagedOutbox, WithoutTheWayToItsMessagesTheyAreSavedAndNoneThatWasDelivered) {
  const int64_t messages = rootPageOf(path_, "messages");
  {
    auto outbox = reopen();
    ASSERT_TRUE(outbox);
    Acknowledgement ack;
    ack.session = 5;
    ack.next_expected = 10;  // their pages keep what they hold until others need the room
    ASSERT_TRUE(outbox->acknowledge(ack));
    ASSERT_TRUE(outbox->takeOutDelivered());
  }
  for (const int64_t page : {int64_t{1}, messages}) {
    const std::string whole = folder_.file("whole");
    std::filesystem::copy_file(path_, whole, std::filesystem::copy_options::overwrite_existing);
    wipePage(path_, page);
    {
      auto rescued = rescueOutbox(path_);
      ASSERT_TRUE(rescued) << rescued.error().text;
      const auto saved = wholeIn(rescued->outbox);
      ASSERT_EQ(saved.size(), 30u) << "page " << page << ": " << rescued->told;
      EXPECT_EQ(saved.front(), 10u);
      EXPECT_GE(*rescued->outbox.lastSession(), 6u);
    }
    std::filesystem::copy_file(whole, path_, std::filesystem::copy_options::overwrite_existing);
  }
}

// As after a sudden end: the newest keyframes stand in the log beside the file.
TEST_F(DamagedOutbox, WhatStandsInItsLogIsSavedToo) {
  const std::string whole = folder_.file("whole");
  std::string log;
  {
    auto outbox = reopen();
    ASSERT_TRUE(outbox);
    put(*outbox, 40, 45);
    std::filesystem::copy_file(path_, whole);
    std::filesystem::copy_file(path_ + "-wal", whole + "-wal");
  }
  for (const int64_t page : {int64_t{1}, rootPageOf(path_, "messages")}) {
    for (const char* part : {"", "-wal"})
      std::filesystem::copy_file(whole + part, path_ + part, std::filesystem::copy_options::overwrite_existing);
    wipePage(path_, page);
    auto rescued = rescueOutbox(path_);
    ASSERT_TRUE(rescued) << rescued.error().text;
    EXPECT_EQ(wholeIn(rescued->outbox).size(), 45u) << "page " << page << ": " << rescued->told;
  }
}

TEST_F(DamagedOutbox, WithoutItsNumbersItIsSavedAndBeginsAboveAll) {
  wipePage(path_, rootPageOf(path_, "meta"));
  auto outbox = reopen();
  ASSERT_TRUE(outbox) << outbox.error().text;
  EXPECT_EQ(wholeIn(*outbox).size(), 40u) << log_;
  EXPECT_NE(log_.find("40 keyframes of it could be saved, 0 not"), std::string::npos) << log_;
  EXPECT_GT(*outbox->beginSession(1), 6u);
}

TEST_F(DamagedOutbox, AFullDiskLeavesItWhereItWas) {
  wipePage(path_, rootPageOf(path_, "meta"));
  const auto before = std::filesystem::file_size(path_);
  rlimit limit{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &limit), 0);
  signal(SIGXFSZ, SIG_IGN);
  const rlimit small{static_cast<rlim_t>(before / 2), limit.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  const auto rescued = rescueOutbox(path_);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &limit), 0);
  ASSERT_FALSE(rescued);
  EXPECT_EQ(rescued.error().code, ErrorCode::kUnreachable);
  EXPECT_NE(rescued.error().text.find("could not be written anew"), std::string::npos) << rescued.error().text;
  EXPECT_EQ(std::filesystem::file_size(path_), before);
  EXPECT_EQ(rescueOutbox(path_)->outbox.size(), 40u);
}

TEST_F(DamagedOutbox, AnotherRobotsIsRefusedAndOneWithoutANameIsTakenOver) {
  std::filesystem::copy_file(path_, folder_.file("s.outbox"));
  const auto refused = reopen("s");
  ASSERT_FALSE(refused) << "its keyframes are robot r's, though it has no name yet";
  EXPECT_EQ(refused.error().code, ErrorCode::kWrongUse);
  EXPECT_NE(refused.error().text.find("is the outbox of robot 'r', this is robot 's'"), std::string::npos)
      << refused.error().text;
  ASSERT_TRUE(reopen("r"));
  ASSERT_TRUE(reopen("r"));
  {
    auto outbox = Outbox::open(path_);
    ASSERT_TRUE(outbox->acknowledge({"r", 5, 40, {}, 0, ""}));
    ASSERT_TRUE(outbox->takeOutDelivered());
  }
  std::filesystem::copy_file(path_, folder_.file("t.outbox"));
  EXPECT_EQ(reopen("t").error().code, ErrorCode::kWrongUse) << "empty, and yet named";
}

}  // namespace
}  // namespace comap
