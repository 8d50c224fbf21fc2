// info, matches, merges and export, as called from the command line.
#include <sys/stat.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "fleet_tools/command_line/text_table.h"
#include "fleet_tools/export/ply.h"
#include "tests/fleet_tools/store/store_verbs_fixture.h"

namespace comap {
namespace {

namespace fs = std::filesystem;

TEST_F(StoreVerbs, infoTellsWhatIsThere) {
  fill(1);
  const Outcome outcome = fleet("info " + store_ + " --json");
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto info = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(info["keyframes"], 6);
  EXPECT_EQ(info["version"], "0.1.0");
  EXPECT_EQ(info["schema_version"], 4);
  EXPECT_EQ(info["robots"][1]["name"], "bravo");
  EXPECT_EQ(info["robots"][1]["keyframes"], 3);
  EXPECT_EQ(info["robots"][1]["bytes"], 3000);
  EXPECT_EQ(info["robots"][1]["maps"], nlohmann::json({"alpha-5-0"}));
  ASSERT_EQ(info["maps"].size(), 1u);
  EXPECT_EQ(info["maps"][0]["robots"], nlohmann::json({"alpha", "bravo"}));
  EXPECT_EQ(info["maps"][0]["surfels"], 2);
  EXPECT_EQ(info["edges"], nlohmann::json({{"odometry", 4}, {"loop", 0}, {"inter_robot", 1}, {"covisibility", 0}}));
  EXPECT_EQ(info["verdicts"], nlohmann::json({{"accepted", 1}, {"refused", {{"round_trip", 2}}}}));
  EXPECT_EQ(info["merges"], 1);
  EXPECT_EQ(info["bytes_on_disk"], fs::file_size(store_));
  const Outcome text = fleet("info " + store_);
  ASSERT_EQ(text.code, 0);
  for (const char* word : {"alpha-5-0", "alpha, bravo", "refused: round_trip", "4 odometry", "3.0 kB"}) {
    EXPECT_NE(text.out.find(word), std::string::npos) << word << "\n" << text.out;
  }
}

TEST_F(StoreVerbs, matchesAndMerges) {
  fill(1);
  const auto all = nlohmann::json::parse(fleet("matches " + store_ + " --json").out)["matches"];
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[0]["query"], "bravo/5/1");
  EXPECT_EQ(all[0]["inlier_ratio"], 0.875);
  EXPECT_EQ(all[0]["accepted"], true);
  EXPECT_EQ(nlohmann::json::parse(fleet("matches --refused --json " + store_).out)["matches"].size(), 2u);
  const std::string refused = fleet("matches --refused " + store_).out;
  EXPECT_NE(refused.find("round_trip"), std::string::npos);
  EXPECT_EQ(refused.find("bravo/5/1  alpha/5/0  accepted"), std::string::npos);
  EXPECT_NE(refused.find("round_trip_m 0.000, round_trip_rad 0.000"), std::string::npos) << refused;
  const auto some = nlohmann::json::parse(fleet("matches --json --reason round_trip --robot bravo " + store_).out);
  EXPECT_EQ(some["matches"].size(), 2u);
  EXPECT_EQ(some["counts"], nlohmann::json({{"accepted", 1}, {"round_trip", 2}}));
  EXPECT_EQ(all[1]["failed"].size(), 2u);
  EXPECT_TRUE(all[0]["failed"].empty());
  const auto merges = nlohmann::json::parse(fleet("merges " + store_ + " --json").out)["merges"];
  ASSERT_EQ(merges.size(), 1u);
  EXPECT_EQ(merges[0]["voters"], nlohmann::json({"bravo/5/1"}));
  EXPECT_NE(fleet("merges " + store_).out.find("bravo-5-0"), std::string::npos);
}

TEST_F(StoreVerbs, exportPlyHoldsTheSurfels) {
  fill(1);
  const Outcome outcome = fleet("export " + store_ + " --format ply --out " + (folder_ / "map.ply").string());
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const auto ply = readPly((folder_ / "map.ply").string());
  ASSERT_TRUE(ply) << ply.error().text;
  ASSERT_EQ(ply->positions.size(), 2u);
  EXPECT_LT((ply->positions[0] - Eigen::Vector3f(0.3f, 0.2f, 1.1f)).norm(), 2e-5f);
  EXPECT_EQ(entries(), (std::set<std::string>{"map.comap", "map.ply"}));
}

TEST_F(StoreVerbs, exportTumGivesEachRobotItsFile) {
  fill(1);
  ASSERT_EQ(fleet("export " + store_ + " --format tum --out " + (folder_ / "tum").string()).code, 0);
  EXPECT_EQ(entries(),
            (std::set<std::string>{"map.comap", "tum", "tum/alpha.trajectory.txt", "tum/bravo.trajectory.txt"}));
  std::ifstream in(folder_ / "tum" / "bravo.trajectory.txt");
  std::string line;
  std::vector<std::string> poses;
  while (std::getline(in, line)) {
    if (line[0] != '#') poses.push_back(line);
  }
  ASSERT_EQ(poses.size(), 3u);
  EXPECT_EQ(poses[1],
            "1.500000100 0.100000000 1.000000000 0.000000000 0.000000000 0.000000000 0.000000000 1.000000000");
}

TEST_F(StoreVerbs, severalMapsAreKeptApart) {
  fill(2);
  const Outcome refused = fleet("export " + store_ + " --format ply --out " + (folder_ / "map.ply").string());
  EXPECT_EQ(refused.code, 2);
  EXPECT_NE(refused.err.find("alpha-5-0, bravo-5-0"), std::string::npos) << refused.err;
  EXPECT_EQ(entries(), std::set<std::string>{"map.comap"});
  EXPECT_EQ(fleet("export " + store_ + " --format ply --map bravo-5-0 --out " + (folder_ / "b.ply").string()).code, 0);
  EXPECT_EQ(fleet("export " + store_ + " --format ply --map x --out " + (folder_ / "c.ply").string()).code, 2);
  EXPECT_EQ(fleet("export " + store_ + " --format tum --out " + (folder_ / "tum").string()).code, 0);
  EXPECT_TRUE(fs::exists(folder_ / "tum" / "bravo-5-0" / "bravo.trajectory.txt"));
}

TEST_F(StoreVerbs, failuresLeaveNoFilesAndSayWhy) {
  const std::string missing = (folder_ / "none.comap").string();
  for (const std::string verb : {"info ", "matches ", "merges ", "export --format ply --out x.ply "}) {
    const Outcome outcome = fleet(verb + missing);
    EXPECT_EQ(outcome.code, 3) << verb;
    EXPECT_EQ(outcome.err, "fleet: " + missing + ": no such file\n");
    EXPECT_EQ(outcome.out, "");
  }
  EXPECT_TRUE(entries().empty());
  fill(1);
  const std::string nowhere = (folder_ / "no" / "such" / "map.ply").string();
  EXPECT_EQ(fleet("export " + store_ + " --format ply --out " + nowhere).code, 3);
  EXPECT_EQ(fleet("export " + store_ + " --format tum --out " + nowhere).code, 3);
  EXPECT_EQ(fleet("export " + store_ + " --format obj --out x").code, 2);
  std::ofstream(folder_ / "file") << "mine";
  EXPECT_EQ(fleet("export " + store_ + " --format tum --out " + (folder_ / "file").string()).code, 2);
  EXPECT_EQ(entries(), (std::set<std::string>{"file", "map.comap"}));
}

TEST_F(StoreVerbs, aViewInWhichNothingLiesIsToldAndNoPicture) {
  fill(1);
  const std::string picture = (folder_ / "map.png").string();
  const std::string render = "render " + store_ + " --size 64x48 --out " + picture;
  for (const std::string view : {"pose 1e30 0 0 0 0 0 1", "pose 0 0 9 0 0 0 1"}) {
    const Outcome away = fleet(render + " --view '" + view + "'");
    EXPECT_EQ(away.code, 1);
    EXPECT_EQ(away.err, "fleet: " + store_ + ": --view '" + view +
                            "', map alpha-5-0: no surfel is in view; no picture is written\n");
    EXPECT_EQ(entries(), (std::set<std::string>{"map.comap"}));
  }
  EXPECT_EQ(fleet(render + " --view 'pose 0.3 0.2 0 0 0 0 1'").code, 0);
  EXPECT_TRUE(entries().contains("map.png"));
}

TEST_F(StoreVerbs, aStoreIsNeverWrittenOver) {
  fill(1);
  const std::string before = fleet("info " + store_ + " --json").out;
  const std::string link = (folder_ / "link.ply").string();
  std::filesystem::create_symlink(store_, link);
  for (const std::string& out : {store_, link})
    for (const std::string verb : {"export --format ply ", "export --format glb ", "export --format tiles3d ",
                                   "export --format tum ", "render "}) {
      const Outcome outcome = fleet(verb + store_ + " --out " + out);
      EXPECT_EQ(outcome.code, 2) << verb << outcome.err;
      EXPECT_NE(outcome.err.find(out), std::string::npos) << outcome.err;
    }
  EXPECT_EQ(fleet("info " + store_ + " --json").out, before);
}

TEST_F(StoreVerbs, whatNoMatchHasIsWrongUse) {
  fill(1);
  const Outcome reason = fleet("matches " + store_ + " --reason nonsense");
  EXPECT_EQ(reason.code, 2);
  EXPECT_NE(reason.err.find("was judged so, but accepted, round_trip"), std::string::npos) << reason.err;
  const Outcome robot = fleet("matches --json --robot carol " + store_);
  EXPECT_EQ(robot.code, 2);
  EXPECT_NE(robot.err.find("holds no robot 'carol', but alpha, bravo"), std::string::npos) << robot.err;
  EXPECT_EQ(robot.out, "");
}

TEST_F(StoreVerbs, aStoreInWhichNothingWasJudgedSaysWhy) {
  ASSERT_TRUE(MapStore::open(store_, MapStore::Mode::kCreateOrOpen));
  for (const std::string options : {"", " --reason round_trip", " --refused"}) {
    const Outcome outcome = fleet("matches " + store_ + options);
    EXPECT_EQ(outcome.code, 0);
    EXPECT_NE(outcome.out.find("nothing was judged: no keyframe"), std::string::npos) << outcome.out;
  }
}

TEST_F(StoreVerbs, outputsThatAreNoFilesAreRefusedAtOnce) {
  fill(1);
  const std::string pipe = (folder_ / "pipe").string();
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  for (const std::string verb : {"export --format ply ", "render "}) {
    for (const auto& [out, why] : {std::pair(pipe, "is no regular file"), std::pair(folder_.string(), "is a folder")}) {
      const Outcome outcome = fleet(verb + store_ + " --out " + out);
      EXPECT_EQ(outcome.code, 2) << verb << out;
      EXPECT_NE(outcome.err.find(why), std::string::npos) << outcome.err;
    }
    const Outcome nowhere = fleet(verb + store_ + " --out " + (folder_ / "no/map.x").string());
    EXPECT_EQ(nowhere.code, 3);
    EXPECT_NE(nowhere.err.find("folder " + (folder_ / "no").string() + " does not exist"), std::string::npos)
        << nowhere.err;
  }
}

TEST_F(StoreVerbs, storesThatAreNoFilesAreRefusedAtOnce) {
  const std::string pipe = (folder_ / "pipe").string();
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  for (const std::string verb : {"info ", "doctor ", "split --later ", "recover --out x.comap ", "finish "}) {
    const std::string rest = verb.starts_with("split") ? " 1" : "";
    EXPECT_NE(fleet(verb + pipe + rest).err.find("is no regular file, expected a map store"), std::string::npos)
        << verb;
    EXPECT_NE(fleet(verb + folder_.string() + rest).err.find("is a folder, expected a map store"), std::string::npos)
        << verb;
  }
}

TEST_F(StoreVerbs, decisionsAreInTheRecordsBeforeTheMaps) {
  fill(1);
  {
    auto store = MapStore::open(store_, MapStore::Mode::kOpen);
    ASSERT_TRUE(store->setMeta("complete", "yes"));
    Edge closure{idOf("alpha", 0), idOf("bravo", 1), EdgeKind::kInterRobot, {}, {}};
    closure.merge = 1;
    ASSERT_TRUE(store->addEdge(closure));
    ASSERT_TRUE(store->addEdge({idOf("alpha", 2), idOf("bravo", 2), EdgeKind::kCovisibility, {}, {}}));
  }
  const auto json = [&](const std::string& command) {
    const Outcome outcome = fleet(command + " --json");
    EXPECT_EQ(outcome.code, 0) << command << outcome.err;
    return outcome.code == 0 ? nlohmann::json::parse(outcome.out) : nlohmann::json();
  };
  EXPECT_EQ(fleet("split " + store_ + " 1 --device nvidia").code, 2) << "before anything is changed";
  EXPECT_EQ(fleet("split " + store_ + " 1 --device 99").code, 3);
  EXPECT_EQ(json("info " + store_)["undone_merges"], 0) << "nor is anything recorded of a device that is not there";
  EXPECT_EQ(fleet("forget " + store_ + " bravo --device 99").code, 3);
  EXPECT_EQ(json("info " + store_)["keyframes"], 6);
  EXPECT_EQ(json("info " + store_)["complete"], true);
  EXPECT_EQ(fleet("split " + store_ + " x").code, 2);
  EXPECT_EQ(fleet("split " + store_ + " 9").code, 2);
  const Outcome split = fleet("split " + store_ + " 1 --later --reason test");
  EXPECT_EQ(split.code, 0) << split.err;
  EXPECT_EQ(
      split.out,
      "merge 1 is undone: test\nthe maps follow with the next start of a core, or with: fleet finish " + store_ + "\n");
  const auto info = json("info " + store_);
  EXPECT_EQ(info["complete"], false);
  EXPECT_EQ(info["undone_merges"], 1);
  EXPECT_EQ(info["withdrawn_edges"], 2) << "the closure, and what tied the same two maps";
  EXPECT_EQ(info["edges"]["odometry"], 4);
  const auto merges = json("merges " + store_)["merges"];
  EXPECT_EQ(merges[0]["undone"], "test");
  EXPECT_EQ(json("split " + store_ + " 1 --undo --later")["rejoined"].size(), 1u);
  EXPECT_EQ(json("info " + store_)["withdrawn_edges"], 0);
  EXPECT_EQ(json("merges " + store_)["merges"][0]["keyframes_ingested"], 6) << "when it was made";
  EXPECT_EQ(json("forget " + store_ + " bravo --later")["keyframes_removed"], 3);
  EXPECT_EQ(json("info " + store_)["keyframes"], 3);
  EXPECT_EQ(json("info " + store_)["compact_due"], true);
  EXPECT_NE(fleet("doctor " + store_).out.find("remark: what was forgotten is overwritten; 'fleet finish'"),
            std::string::npos);
  {
    auto store = MapStore::open(store_, MapStore::Mode::kOpen);
    ASSERT_TRUE(store->setMeta("complete", "yes"));  // as if the maps had been computed
  }
  EXPECT_EQ(json("finish " + store_), (nlohmann::json{{"computed", false}, {"compacted", true}}));
  EXPECT_EQ(json("info " + store_)["compact_due"], false);
  EXPECT_EQ(json("finish " + store_), (nlohmann::json{{"computed", false}, {"compacted", false}}));
}

TEST_F(StoreVerbs, robotNamesBecomeNoPaths) {
  {
    auto store = MapStore::open(store_, MapStore::Mode::kCreateOrOpen);
    ASSERT_TRUE(store);
    const KeyframeId evil{"../../evil\x1b[31m", 1, 0};
    ASSERT_TRUE(*store->addKeyframe(evil, 0, {}));
    ASSERT_TRUE(store->setPoses("m", {{evil, {}}}));
  }
  const Outcome outcome = fleet("export " + store_ + " --format tum --out " + (folder_ / "tum").string());
  EXPECT_EQ(outcome.code, 3);
  EXPECT_EQ(entries(), std::set<std::string>{"map.comap"});
  EXPECT_EQ((outcome.err + fleet("info " + store_).out).find('\x1b'), std::string::npos);
}

TEST(TextTable, alignsNumbersRightAndCleansText) {
  TextTable table({"NAME", "COUNT"});
  table.add({"a", "5"});
  table.add({"l\xc3\xa4nger\n", "1234"});
  EXPECT_EQ(table.text(), "NAME     COUNT\na            5\nl\xc3\xa4nger?   1234\n");
  EXPECT_EQ(printable("a\x1b[0m\xff\xc2\x9b\xe2\x82\xac"), "a?[0m??\xe2\x82\xac");
  EXPECT_EQ(humanBytes(999), "999 B");
  EXPECT_EQ(humanBytes(1500000), "1.5 MB");
}

}  // namespace
}  // namespace comap
