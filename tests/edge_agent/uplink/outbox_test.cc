#include "edge_agent/uplink/outbox.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>

#include "edge_agent/uplink/outbox_place.h"
#include "tests/edge_agent/uplink/outbox_file.h"

namespace comap {
namespace {

TEST_F(OutboxFile, KeepsWhatIsNotAcknowledgedOverTheEndOfTheProcess) {
  {
    auto outbox = Outbox::open(path_);
    ASSERT_TRUE(outbox) << outbox.error().text;
    ASSERT_EQ(*outbox->beginSession(5), 5u);
    put(*outbox, 0, 10);
    ASSERT_TRUE(outbox->markSent({5, 3}));
    Acknowledgement ack{"r", 5, 3, {4, 7}, 0, ""};
    const auto held = outbox->acknowledge(ack);
    ASSERT_TRUE(held) << held.error().text;
    EXPECT_EQ(held->size(), 5u);
    EXPECT_EQ(outbox->size(), 5u);
    EXPECT_EQ(outbox->deliveredButThere().size(), 5u);
    ASSERT_TRUE(outbox->takeOutDelivered());
    EXPECT_EQ(outbox->deliveredButThere().size(), 0u);
  }
  auto outbox = Outbox::open(path_);
  ASSERT_TRUE(outbox) << outbox.error().text;
  EXPECT_EQ(outbox->size(5), 5u);
  std::vector<uint32_t> left;
  for (const OutboxRow& row : rowsFrom(*outbox)) {
    left.push_back(row.key.sequence);
    EXPECT_EQ(row.sent, row.key.sequence == 3);
    EXPECT_EQ(bytesOf(*outbox, row.key), messageOf(row.key.sequence));
    EXPECT_EQ(row.link.linked_to, row.key.sequence - 1);
    EXPECT_NEAR(row.link.T_link_this.translation().x(), 0.1, 1e-12);
    EXPECT_EQ(row.link.information(2, 2), 1e4);
  }
  EXPECT_EQ(left, (std::vector<uint32_t>{3, 5, 6, 8, 9}));
  ASSERT_TRUE(outbox->acknowledge({"r", 5, 10, {}, 0, ""}));
  EXPECT_EQ(outbox->size(), 0u);
  EXPECT_EQ(outbox->bytes(), 0u);
}

TEST_F(OutboxFile, AnAcknowledgementOfAnotherSessionOrARefusalTakesNothing) {
  auto outbox = Outbox::open(path_);
  ASSERT_TRUE(outbox);
  put(*outbox, 0, 3);
  EXPECT_TRUE(outbox->acknowledge({"r", 6, 3, {}, 0, ""})->empty());
  EXPECT_TRUE(outbox->acknowledge({"r", 5, 3, {}, 0, "go away"})->empty());
  EXPECT_EQ(outbox->size(), 3u);
}

TEST_F(OutboxFile, SessionsOnlyGrowWhateverTheClockSays) {
  for (const auto& [wished, given] : {std::pair(100u, 100u), {100u, 101u}, {7u, 102u}, {200u, 200u}}) {
    auto outbox = Outbox::open(path_);
    ASSERT_TRUE(outbox);
    EXPECT_EQ(*outbox->beginSession(wished), given);
  }
}

// The writer is killed in the middle of its work, many times: what it had been told is stored is there, and whole.
TEST_F(OutboxFile, KillNineAtAnyMomentLosesNothingThatWasStored) {
  uint32_t stored = 0;
  for (int round = 0; round < 12; ++round) {
    int ends[2];
    ASSERT_EQ(pipe(ends), 0);
    const pid_t writer = fork();
    if (writer == 0) {
      auto outbox = Outbox::open(path_);
      for (uint32_t i = stored; outbox; ++i) {
        if (!outbox->add(rowOf(keyframeAt(5, i, 0, 0)), messageOf(i))) _exit(1);
        if (write(ends[1], &i, sizeof i) != sizeof i) _exit(1);
      }
      _exit(1);
    }
    close(ends[1]);
    uint32_t last = 0;
    const auto target = stored + 3 + static_cast<uint32_t>(round);
    while (read(ends[0], &last, sizeof last) == sizeof last && last < target) {
    }
    kill(writer, SIGKILL);
    int status = 0;
    waitpid(writer, &status, 0);
    ASSERT_TRUE(WIFSIGNALED(status)) << "the writer ended by itself";
    while (read(ends[0], &last, sizeof last) == sizeof last) {
    }
    close(ends[0]);
    auto outbox = Outbox::open(path_);
    ASSERT_TRUE(outbox) << outbox.error().text;
    ASSERT_GE(outbox->size(), last + 1);
    stored = static_cast<uint32_t>(outbox->size());
    for (uint32_t i = 0; i < stored; ++i) ASSERT_EQ(bytesOf(*outbox, {5, i}), messageOf(i)) << i;
  }
}

TEST_F(OutboxFile, ASecondAgentIsTold) {
  auto first = Outbox::open(path_);
  ASSERT_TRUE(first);
  const auto second = Outbox::open(path_);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::kUnreachable);
  EXPECT_NE(second.error().text.find(path_), std::string::npos);
  EXPECT_NE(second.error().text.find("another edge_agent"), std::string::npos);
}

TEST_F(OutboxFile, AnotherProgramsDatabaseIsLeftAlone) {
  {
    auto other = Database::open(path_, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
    ASSERT_TRUE(other->execute("CREATE TABLE t (a); PRAGMA application_id = 7"));
  }
  const auto outbox = Outbox::open(path_);
  ASSERT_FALSE(outbox);
  EXPECT_EQ(outbox.error().code, ErrorCode::kWrongUse);
  EXPECT_NE(outbox.error().text.find("no outbox"), std::string::npos);
}

TEST(OutboxPlace, ComesFromTheConfigurationOrTheEnvironment) {
  unsetenv("STATE_DIRECTORY");
  setenv("XDG_STATE_HOME", "/state", 1);
  EXPECT_EQ(*outboxPath({}, "a"), "/state/comap/a.outbox");
  setenv("STATE_DIRECTORY", "/var/lib/comap:/other", 1);
  EXPECT_EQ(*outboxPath({}, "a"), "/var/lib/comap/a.outbox");
  OutboxOptions options;
  options.directory = "/d";
  EXPECT_EQ(*outboxPath(options, "a"), "/d/a.outbox");
  for (const char* name : {"STATE_DIRECTORY", "XDG_STATE_HOME", "HOME"}) unsetenv(name);
  EXPECT_EQ(outboxPath({}, "a").error().code, ErrorCode::kWrongUse);
}

TEST(OutboxPlace, AFolderThatCannotBeMadeIsToldWithWhatToDo) {
  ScratchFolder folder;
  std::ofstream(folder.file("file")) << "x";
  OutboxOptions options;
  options.directory = folder.file("file") + "/below";
  const auto outbox = openOutbox(options, "a", 1, [](const std::string&) {});
  ASSERT_FALSE(outbox);
  EXPECT_EQ(outbox.error().code, ErrorCode::kUnreachable);
  EXPECT_NE(outbox.error().text.find(options.directory), std::string::npos);
  EXPECT_NE(outbox.error().text.find("--outbox"), std::string::npos);
}

}  // namespace
}  // namespace comap
