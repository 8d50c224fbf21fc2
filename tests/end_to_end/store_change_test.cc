// A run's store is taken apart, joined again and relieved of a robot by the real programs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <thread>

#include "protocol/storage/database.h"
#include "tests/end_to_end/background.h"
#include "tests/end_to_end/flat_test.h"

namespace comap {
namespace {

using Json = nlohmann::json;
using testing::HasSubstr;

class StoreChange : public FlatTest {
 protected:
  // A map's name -> its hash.
  static std::map<std::string, std::string> hashes(const Json& document) {
    std::map<std::string, std::string> result;
    for (const Json& map : document.at("maps"))
      result[map.at("id").get<std::string>()] = map.at("hash").get<std::string>();
    return result;
  }
  Json json(const std::string& command) {
    const ProgramRun run = runProgram(command + " --json");
    EXPECT_EQ(run.exit_code, 0) << command << "\n" << run.err;
    return run.exit_code == 0 ? Json::parse(run.out) : Json::object({{"maps", Json::array()}});
  }
  void refused(const std::string& command, int exit_code, const std::string& why) {
    const ProgramRun run = runProgram(command);
    EXPECT_EQ(run.exit_code, exit_code) << command;
    EXPECT_THAT(run.err, HasSubstr(why)) << command;
  }

  static std::string metaOf(const std::string& store, const char* select) {
    auto database = Database::open(store, SQLITE_OPEN_READONLY);
    EXPECT_TRUE(database);
    auto row = database->query(select);
    EXPECT_TRUE(row && *row->step()) << select;
    return row->text();
  }
  // A core starts on the store, hears nothing, and ends.
  void letACoreEnd(const std::string& store) {
    const std::string log = folder_.path("core.log");
    Background core("mapping_core",
                    {"--domain", "93", "--core-site", "change-" + std::to_string(getpid()), "--store", store}, log);
    for (int i = 0; i < 600 && core.runs() && contentOf(log).find("to be mapped") == std::string::npos; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    ASSERT_EQ(core.end(SIGTERM), 0) << contentOf(log);
  }

  const std::string store_ = folder_.path("run/map.comap");
};

TEST_F(StoreChange, ASplitGivesTheMapsOfBeforeAndItsUndoingTheMapOfAfter) {
  const auto joint = hashes(json("fleet replay --link loopback --robot a=" + flat_ + "/a --robot b=" + flat_ +
                                 "/b --out " + folder_.path("run")));
  ASSERT_EQ(joint.size(), 1u);
  const auto alone =
      hashes(json("fleet replay --link loopback --robot a=" + flat_ + "/a --out " + folder_.path("alone")));

  refused("fleet split " + store_ + " 9", 2, "merge 9 is not in the store");
  refused("fleet split " + store_ + " 1 --undo", 2, "is not undone");
  refused("fleet forget " + store_ + " nobody", 2, "holds no robot 'nobody', but a, b");
  refused("fleet split " + folder_.path("none.comap") + " 1", 3, "no such file");

  const std::string later = folder_.path("later.comap");
  std::filesystem::copy_file(store_, later);

  const Json parted = json("fleet split " + store_ + " 1 --reason \"the test says so\"");
  EXPECT_EQ(parted.at("undone").size(), 1u);
  const auto two = hashes(parted);
  ASSERT_EQ(two.size(), 2u);
  EXPECT_EQ(two.at("a-1-0"), alone.at("a-1-0")) << "as if robot b had never been seen";
  EXPECT_FALSE(json("fleet split " + later + " 1 --later").at("computed").get<bool>());
  EXPECT_FALSE(json("fleet info " + later).at("complete").get<bool>());
  EXPECT_EQ(hashes(json("fleet finish " + later)), two);
  EXPECT_EQ(json("fleet merges " + store_).at("merges")[0].at("undone"), "the test says so");
  const Json info = json("fleet info " + store_);
  EXPECT_EQ(info.at("undone_merges"), 1);
  EXPECT_GE(info.at("withdrawn_edges").get<int>(), 2);
  EXPECT_EQ(info.at("edges").at("inter_robot"), 0);
  EXPECT_TRUE(info.at("complete").get<bool>());
  refused("fleet split " + store_ + " 1", 2, "is undone already: the test says so");

  const Json again = json("fleet split " + store_ + " 1 --undo");
  EXPECT_EQ(hashes(again), joint);
  EXPECT_EQ(json("fleet info " + store_).at("withdrawn_edges"), 0);

  const std::string by_hand = folder_.path("by-hand.comap");
  std::filesystem::copy_file(store_, by_hand);
  json("fleet forget " + later + " b --later");
  letACoreEnd(later);
  EXPECT_EQ(metaOf(later, "SELECT value FROM meta WHERE key = 'votes_wait'"), "no");
  EXPECT_EQ(json("fleet finish " + later), Json({{"computed", false}, {"compacted", false}}))
      << "nothing is left to be done";

  const Json left = json("fleet forget " + store_ + " b");
  EXPECT_GT(left.at("keyframes_removed").get<int>(), 5);
  EXPECT_EQ(hashes(left), alone);
  EXPECT_FALSE(json("fleet forget " + by_hand + " b --later").at("compacted").get<bool>());
  EXPECT_GT(std::filesystem::file_size(by_hand), std::filesystem::file_size(store_)) << "the pictures are in it";
  const Json finished = json("fleet finish " + by_hand);
  EXPECT_EQ(hashes(finished), alone) << "in two steps the same as in one";
  EXPECT_TRUE(finished.at("compacted").get<bool>());
  EXPECT_EQ(std::filesystem::file_size(by_hand), std::filesystem::file_size(store_));
  const auto plyOf = [&](const std::string& store) {
    EXPECT_EQ(runProgram("fleet export " + store + " --format ply --out " + folder_.path("map.ply")).exit_code, 0);
    return contentOf(folder_.path("map.ply"));
  };
  EXPECT_TRUE(plyOf(later) == plyOf(store_)) << "the core left the same map";
  const Json rest = json("fleet info " + store_);
  EXPECT_EQ(rest.at("robots").size(), 1u);
  EXPECT_EQ(rest.at("merges"), 0);
  for (const Json& match : json("fleet matches " + store_).at("matches"))
    EXPECT_EQ(match.dump().find("\"b/"), std::string::npos) << match;
}

}  // namespace
}  // namespace comap
