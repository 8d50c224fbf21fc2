// A robot whose core and whose own process are killed: what it had mapped by then comes to the core later.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <functional>
#include <nlohmann/json.hpp>
#include <thread>

#include "protocol/codec/message_checksum.h"
#include "protocol/storage/database.h"
#include "tests/end_to_end/background.h"
#include "tests/end_to_end/flat_test.h"
#include "tests/files/damaged_database.h"

namespace comap {
namespace {

using Json = nlohmann::json;

class DurableOutbox : public FlatTest {
 protected:
  std::unique_ptr<Background> core() {
    return std::make_unique<Background>(
        "mapping_core", std::vector<std::string>{"--domain", "93", "--core-site", site_, "--store", store_},
        folder_.path("core.log"));
  }
  std::vector<std::string> agentOptions(const std::vector<std::string>& more) {
    std::vector<std::string> options = {"--domain", "93",       "--core-site",  site_,      "--robot",
                                        "a",        "--outbox", folder_.path(), "--report", folder_.path("a.json")};
    options.insert(options.end(), more.begin(), more.end());
    return options;
  }
  std::unique_ptr<Background> agent(const std::vector<std::string>& more) {
    return std::make_unique<Background>("edge_agent", agentOptions(more), folder_.path("a.log"));
  }
  std::string recording(int first, int end) {
    return "tum:" + flat_ + "/a@" + std::to_string(first) + ":" + std::to_string(end);
  }
  // Keyframes that were made, by what the outbox holds; -1 if it cannot be read now.
  int64_t madeSoFar() {
    auto box =
        Database::open("file:" + folder_.path("a.outbox") + "?immutable=0", SQLITE_OPEN_READONLY | SQLITE_OPEN_URI);
    if (!box) return -1;
    const auto last = box->integer("SELECT coalesce(max(sequence) + 1, 0) FROM keyframes");
    return last ? *last : -1;
  }
  bool await(const std::function<bool()>& what, int tenths) {
    for (int i = 0; i < tenths; ++i) {
      if (what()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    return false;
  }
  Json info() {
    const ProgramRun run = runProgram("fleet info --json " + store_);
    return run.exit_code == 0 ? Json::parse(run.out) : Json();
  }

  const std::string site_ = "outbox-" + std::to_string(getpid());  // these tests may run side by side
  const std::string store_ = folder_.path("map.comap");
};

TEST_F(DurableOutbox, KillNineOfCoreAndAgentLosesNoKeyframe) {
  auto first_core = core();
  auto first = agent({"--source", recording(0, 120), "--realtime"});
  ASSERT_TRUE(await([&] { return !info().is_null() && info().at("keyframes").get<int>() >= 2; }, 300))
      << contentOf(folder_.path("core.log")) << contentOf(folder_.path("a.log"));
  EXPECT_EQ(first_core->end(SIGKILL), 128 + SIGKILL);
  // The robot goes on without a core, until it is killed as well.
  std::this_thread::sleep_for(std::chrono::milliseconds(2000));
  ASSERT_TRUE(first->runs()) << contentOf(folder_.path("a.log"));
  EXPECT_EQ(first->end(SIGKILL), 128 + SIGKILL);
  const int64_t made = madeSoFar();
  ASSERT_GT(made, info().at("keyframes").get<int64_t>()) << "some were made after the core was gone";

  auto second_core = core();
  auto second = agent({"--source", recording(60, 120)});
  EXPECT_EQ(second->wait(), 0) << contentOf(folder_.path("a.log"));
  EXPECT_EQ(second_core->end(SIGTERM), 0) << contentOf(folder_.path("core.log"));
  EXPECT_NE(contentOf(folder_.path("a.log")).find("keyframes of earlier starts wait"), std::string::npos);

  const Json after = info(), report = Json::parse(contentOf(folder_.path("a.json")));
  ASSERT_FALSE(after.is_null());
  EXPECT_EQ(after.at("robots")[0].at("sessions"), 2) << "no number was used twice";
  EXPECT_EQ(after.at("keyframes").get<int64_t>(), made + report.at("keyframes").get<int64_t>());
  EXPECT_EQ(after.at("keyframes_without_pose"), 0);
  EXPECT_EQ(report.at("unacknowledged"), 0);
  EXPECT_EQ(madeSoFar(), 0) << "the outbox is empty";
}

TEST_F(DurableOutbox, OfflineNowDeliveredLater) {
  auto offline = agent({"--source", recording(0, 60), "--offline"});
  EXPECT_EQ(offline->wait(), 0) << contentOf(folder_.path("a.log"));
  const int64_t made = madeSoFar();
  EXPECT_GE(made, 3);
  auto core_now = core();
  auto deliver = agent({"--deliver"});
  EXPECT_EQ(deliver->wait(), 0) << contentOf(folder_.path("a.log"));
  EXPECT_EQ(core_now->end(SIGTERM), 0);
  EXPECT_EQ(info().at("keyframes").get<int64_t>(), made);
  EXPECT_EQ(info().at("keyframes_without_pose"), 0);
  EXPECT_EQ(madeSoFar(), 0);
}

// As if another release of the agent had made it: one keyframe amid the others that the core cannot take, until it is
// another core.
TEST_F(DurableOutbox, AKeyframeThatTheCoreCannotTakeHoldsUpNoneBehindIt) {
  auto offline = agent({"--source", recording(0, 120), "--offline"});
  EXPECT_EQ(offline->wait(), 0) << contentOf(folder_.path("a.log"));
  const int64_t made = madeSoFar(), middle = made / 2;
  ASSERT_GE(made, 5);
  const auto setMajor = [&](uint8_t major) {
    auto box = Database::open(folder_.path("a.outbox"), SQLITE_OPEN_READWRITE);
    auto read = box->query("SELECT encoded FROM messages WHERE sequence = ?");
    ASSERT_TRUE(read && *read->bind(middle).step());
    const auto bytes = read->bytes();
    std::vector<uint8_t> message(bytes.begin(), bytes.end());
    ASSERT_EQ(message[0], 8) << "field 1 comes first";
    message[1] = major;
    auto message_row = box->query("UPDATE messages SET encoded = ? WHERE sequence = ?");
    ASSERT_TRUE(message_row->bind(std::span<const uint8_t>(message)).bind(middle).run());
    auto row = box->query("UPDATE keyframes SET crc32 = ? WHERE sequence = ?");
    ASSERT_TRUE(row->bind(int64_t{messageChecksum(message)}).bind(middle).run());
  };
  setMajor(2);
  auto first_core = core();
  auto deliver = agent({"--deliver"});
  EXPECT_EQ(deliver->wait(), 1) << contentOf(folder_.path("a.log"));
  EXPECT_NE(contentOf(folder_.path("a.log")).find("the core refuses 1 keyframe: keyframe: protocol major 2"),
            std::string::npos)
      << contentOf(folder_.path("a.log"));
  // A core that is at work hears what the agent said last when it has done its step, not when the agent ends.
  EXPECT_TRUE(await(
      [&] { return contentOf(folder_.path("core.log")).find("goes on without keyframe a/") != std::string::npos; },
      600))
      << contentOf(folder_.path("core.log"));
  EXPECT_EQ(first_core->end(SIGTERM), 0) << contentOf(folder_.path("core.log"));
  Json now = info();
  EXPECT_EQ(now.at("keyframes").get<int64_t>(), made - 1);
  EXPECT_EQ(now.at("keyframes_without_pose"), 0) << "none waits for it";
  EXPECT_EQ(now.at("maps").size(), 1u) << "tied across the gap";

  setMajor(1);
  auto second_core = core();
  auto again = agent({"--deliver"});
  EXPECT_EQ(again->wait(), 0) << contentOf(folder_.path("a.log"));
  EXPECT_EQ(second_core->end(SIGTERM), 0) << contentOf(folder_.path("core.log"));
  now = info();
  EXPECT_EQ(now.at("keyframes").get<int64_t>(), made);
  EXPECT_EQ(now.at("keyframes_without_pose"), 0);
  EXPECT_EQ(now.at("maps").size(), 1u) << "it is part of it";
  EXPECT_EQ(madeSoFar(), 0);
}

class DamagedOutboxFile : public DurableOutbox {
 protected:
  // The end of a keyframe's message, as it stands in the file.
  std::vector<uint8_t> endOfMessage(int sequence) {
    auto box = Database::open(outbox_, SQLITE_OPEN_READWRITE);
    auto query = box->query("SELECT encoded FROM messages WHERE sequence = ?");
    EXPECT_TRUE(query && *query->bind(int64_t{sequence}).step());
    const auto bytes = query->bytes();
    return {bytes.end() - 300, bytes.end() - 260};
  }
  // How many the agent could save, as it says; -1 if it says nothing.
  int savedAsTold() const {
    const std::string log = contentOf(folder_.path("a.log"));
    const size_t told = log.find("was put aside as ");
    const size_t number = told == std::string::npos ? told : log.find("; ", told);
    return number == std::string::npos ? -1 : std::stoi(log.substr(number + 2));
  }
  const std::string outbox_ = folder_.path("a.outbox");
};

TEST_F(DamagedOutboxFile, WhileTheAgentIsStoppedCostsOnlyWhatIsDamaged) {
  ASSERT_EQ(agent({"--source", recording(0, 60), "--offline"})->wait(), 0) << contentOf(folder_.path("a.log"));
  const int64_t made = madeSoFar();
  ASSERT_GE(made, 4);
  const std::string whole = folder_.path("whole");
  std::filesystem::copy_file(outbox_, whole);
  const int64_t page = pageOf(outbox_, endOfMessage(1)), numbers = rootPageOf(outbox_, "meta");
  ASSERT_GT(page, 0);
  for (const std::string damage : {"numbers", "a keyframe", "cut off"}) {
    std::filesystem::copy_file(whole, outbox_, std::filesystem::copy_options::overwrite_existing);
    for (const char* end : {"", "-wal", "-shm"}) std::filesystem::remove(store_ + end);
    std::filesystem::remove(folder_.path("a.log"));
    if (damage == "numbers") wipePage(outbox_, numbers);
    if (damage == "a keyframe") wipePage(outbox_, page);
    if (damage == "a keyframe") wipePage(outbox_, numbers);  // so that it is found before the first is sent
    if (damage == "cut off") std::filesystem::resize_file(outbox_, std::filesystem::file_size(whole) * 3 / 4);
    auto core_now = core();
    EXPECT_EQ(agent({"--deliver"})->wait(), damage == "numbers" ? 0 : 1) << damage << contentOf(folder_.path("a.log"));
    const std::string log = contentOf(folder_.path("a.log"));
    EXPECT_EQ(log.find("with a damaged outbox") == std::string::npos, damage == "numbers") << log;
    EXPECT_EQ(log.find("outbox is full"), std::string::npos) << log;
    EXPECT_EQ(core_now->end(SIGTERM), 0) << contentOf(folder_.path("core.log"));
    const int64_t arrived = info().at("keyframes").get<int64_t>();
    EXPECT_EQ(info().at("keyframes_without_pose"), 0) << "the core waits for nothing";
    EXPECT_EQ(arrived, savedAsTold()) << damage << contentOf(folder_.path("a.log"));
    const int64_t least = damage == "numbers" ? made : damage == "a keyframe" ? made - 2 : made / 2;
    EXPECT_GE(arrived, least) << damage;
    EXPECT_EQ(arrived < made, damage != "numbers") << damage;
  }
}

TEST_F(DamagedOutboxFile, WhileTheAgentRunsCostsOnlyWhatIsDamaged) {
  ASSERT_EQ(agent({"--source", recording(0, 60), "--offline"})->wait(), 0) << contentOf(folder_.path("a.log"));
  const int64_t made = madeSoFar();
  ASSERT_GE(made, 4);
  const int64_t page = pageOf(outbox_, endOfMessage(1));
  ASSERT_GT(page, 0);
  auto running = agent({"--source", recording(60, 120), "--realtime"});
  ASSERT_TRUE(await([&] { return contentOf(folder_.path("a.log")).find("TUM sequence") != std::string::npos; }, 300));
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  wipePage(outbox_, page);
  auto core_now = core();
  EXPECT_EQ(running->wait(), 1) << "all arrived but for what was damaged" << contentOf(folder_.path("a.log"));
  EXPECT_EQ(core_now->end(SIGTERM), 0) << contentOf(folder_.path("core.log"));
  EXPECT_GT(savedAsTold(), 0) << contentOf(folder_.path("a.log"));
  const auto now = Json::parse(contentOf(folder_.path("a.json"))).at("keyframes").get<int64_t>();
  const auto arrived = info().at("keyframes").get<int64_t>();
  EXPECT_LT(arrived, made + now);
  EXPECT_GE(arrived, made + now - 2);
  EXPECT_EQ(Json::parse(contentOf(folder_.path("a.json"))).at("keyframes_damaged"), made + now - arrived);
  EXPECT_EQ(Json::parse(contentOf(folder_.path("a.json"))).at("keyframes_dropped"), 0);
  EXPECT_EQ(info().at("keyframes_without_pose"), 0) << "the core waits for nothing";
}

TEST_F(DurableOutbox, ASecondAgentOfTheSameNameIsTold) {
  auto first = agent({"--source", recording(0, 120), "--realtime", "--patience", "3"});
  ASSERT_TRUE(await([&] { return contentOf(folder_.path("a.log")).find("TUM sequence") != std::string::npos; }, 100));
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  std::string command = "edge_agent --robot a --offline --source " + recording(0, 10) + " --outbox " + folder_.path();
  const ProgramRun second = runProgram(command);
  EXPECT_EQ(second.exit_code, 3);
  EXPECT_NE(second.err.find("another edge_agent"), std::string::npos) << second.err;
  EXPECT_EQ(first->wait(), 3) << "no core came";
  EXPECT_NE(contentOf(folder_.path("a.log")).find("are sent by the next start"), std::string::npos);
}

}  // namespace
}  // namespace comap
