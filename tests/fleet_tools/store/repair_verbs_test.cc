// doctor, recover and finish, as called from the command line.
#include <fstream>
#include <nlohmann/json.hpp>

#include "protocol/codec/keyframe_codec.h"
#include "protocol/storage/database.h"
#include "tests/fleet_tools/store/store_verbs_fixture.h"

namespace comap {
namespace {

namespace fs = std::filesystem;

class RepairVerbs : public StoreVerbs {
 protected:
  // A store of one keyframe that can be read.
  void fillWhole() {
    Keyframe keyframe;
    keyframe.id = idOf("alpha", 0);
    keyframe.camera = {20, 20, 15.5, 11.5, 32, 24};
    keyframe.colour = ColourImage(32, 24);
    keyframe.depth = DepthImage(32, 24, 2000);
    const auto encoded = encodeKeyframe(keyframe);
    ASSERT_TRUE(encoded) << encoded.error().text;
    auto store = MapStore::open(store_, MapStore::Mode::kCreateOrOpen);
    ASSERT_TRUE(store && *store->addKeyframe(keyframe.id, 1, *encoded));
    ASSERT_TRUE(store->setPoses("alpha-5-0", {{keyframe.id, Pose()}}));
    ASSERT_TRUE(store->setMeta("complete", "yes"));
  }
  // A copy as it is when its writer is killed within a change.
  std::string killedCopy() {
    const std::string killed = (folder_ / "killed.comap").string();
    auto database = Database::open(store_, SQLITE_OPEN_READWRITE);
    EXPECT_TRUE(database && database->execute("PRAGMA cache_size = 1; PRAGMA cache_spill = 1; BEGIN; "
                                              "DELETE FROM keyframes; CREATE TABLE half (a); INSERT INTO half "
                                              "VALUES (zeroblob(100000)); DROP TABLE half"));
    for (const char* part : {"", "-journal"}) fs::copy_file(store_ + part, killed + part);
    EXPECT_TRUE(database->execute("ROLLBACK"));
    return killed;
  }
};

TEST_F(RepairVerbs, aStoreIsNotSavedBesideTheLogOfAnother) {
  fill(1);
  const std::string saved = (folder_ / "saved.comap").string();
  std::ofstream(saved + "-wal") << "another store's";
  const Outcome outcome = fleet("recover --later " + store_ + " --out " + saved);
  EXPECT_EQ(outcome.code, 2);
  EXPECT_NE(outcome.err.find(saved + "-wal is there, of another store"), std::string::npos) << outcome.err;
  EXPECT_EQ(entries(), (std::set<std::string>{"map.comap", "saved.comap-wal"}));
}

TEST_F(RepairVerbs, whatIsNoDraftStaysWhereADraftWouldBe) {
  fill(1);
  const std::string saved = (folder_ / "saved.comap").string();
  std::ofstream(saved + ".part") << "notes";
  const Outcome outcome = fleet("recover --later " + store_ + " --out " + saved);
  EXPECT_EQ(outcome.code, 2);
  EXPECT_NE(outcome.err.find("is no half of a store"), std::string::npos) << outcome.err;
  EXPECT_EQ(entries(), (std::set<std::string>{"map.comap", "saved.comap.part"}));
  std::ofstream(saved + ".part") << "SQLite format 3";  // of one that was interrupted
  EXPECT_NE(fleet("recover --later " + store_ + " --out " + saved).code, 2);
  EXPECT_FALSE(entries().contains("saved.comap.part"));
  EXPECT_EQ(fleet("recover --later " + store_ + " --out ''").code, 2);
}

TEST_F(RepairVerbs, aStoreIsNotSavedOverItself) {
  fill(1);
  const std::string half = (folder_ / "saved.comap.part").string();
  fs::rename(store_, half);
  const Outcome outcome = fleet("recover --later " + half + " --out " + (folder_ / "saved.comap").string());
  EXPECT_EQ(outcome.code, 2);
  EXPECT_NE(outcome.err.find("which is the damaged store"), std::string::npos) << outcome.err;
  EXPECT_EQ(entries(), std::set<std::string>{"saved.comap.part"});
  EXPECT_EQ(nlohmann::json::parse(fleet("info --json " + half).out)["keyframes"], 6);
}

TEST_F(RepairVerbs, aStoreWithoutItsFirstPageIsSaved) {
  fillWhole();
  const std::string saved = (folder_ / "saved.comap").string();
  std::fstream(store_, std::ios::in | std::ios::out | std::ios::binary) << std::string(16384, 'x');
  const std::string damaged = contentOf(store_);
  const Outcome told = fleet("doctor " + store_);
  EXPECT_EQ(told.code, 3);
  EXPECT_NE(told.err.find("'fleet recover " + store_ + " --out NEW' looks for what is whole"), std::string::npos);
  const Outcome outcome = fleet("recover --later " + store_ + " --out " + saved);
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("damage: the file's first page: read with that of a new store"), std::string::npos);
  EXPECT_NE(outcome.out.find("whole: 1 keyframes"), std::string::npos) << outcome.out;
  EXPECT_EQ(fleet("doctor " + saved).code, 0);
  EXPECT_EQ(contentOf(store_), damaged);
  EXPECT_EQ(entries(), (std::set<std::string>{"map.comap", "saved.comap"}));
}

TEST_F(RepairVerbs, aChangeThatWasHalfDoneIsTakenBackInTheCopyThatIsSaved) {
  fillWhole();
  const std::string killed = killedCopy(), saved = (folder_ / "saved.comap").string();
  const std::string file = contentOf(killed), journal = contentOf(killed + "-journal");
  const auto before = entries();
  const Outcome recovered = fleet("recover " + killed + " --later --out " + saved);
  EXPECT_EQ(recovered.code, 0) << recovered.err;
  EXPECT_NE(recovered.err.find("its writer was killed within a change, which is not saved"), std::string::npos);
  EXPECT_NE(recovered.out.find("whole: 1 keyframes"), std::string::npos) << recovered.out;
  EXPECT_TRUE(contentOf(killed) == file && contentOf(killed + "-journal") == journal) << "the source stays as it is";
  auto after = entries();
  EXPECT_EQ(after.erase("saved.comap"), 1u);
  EXPECT_EQ(after, before);
  EXPECT_EQ(fleet("doctor " + saved).code, 0);
}

TEST_F(RepairVerbs, doctorTakesBackAChangeThatWasHalfDoneAndNothingElse) {
  fillWhole();
  const std::string killed = killedCopy();
  ASSERT_NE(contentOf(killed), contentOf(store_));
  const Outcome first = fleet("doctor " + killed), second = fleet("doctor " + killed);
  EXPECT_EQ(first.code, 0) << first.err << first.out;
  EXPECT_NE(first.out.find("remark: its writer was killed within a change"), std::string::npos) << first.out;
  EXPECT_EQ(contentOf(killed), contentOf(store_));
  EXPECT_EQ(second.code, 0);
  EXPECT_EQ(second.out.find("remark"), std::string::npos) << second.out;
  EXPECT_FALSE(fs::exists(killed + "-journal"));
}

// Of a store that was not closed, SQLite makes a log for whoever reads it.
TEST_F(RepairVerbs, whoOnlyReadsLeavesNothingBehind) {
  fillWhole();
  {
    auto database = Database::open(store_, SQLITE_OPEN_READWRITE);
    ASSERT_TRUE(database && database->execute("PRAGMA journal_mode = WAL"));
  }
  const std::string file = contentOf(store_);
  const auto before = entries();
  for (const std::string verb :
       {"info ", "matches ", "merges ", "doctor ", "doctor --full ", "recover --later --out "}) {
    const std::string saved = (folder_ / "saved.comap").string();
    const Outcome outcome = fleet(verb + (verb.starts_with("recover") ? saved + " " : "") + store_);
    EXPECT_EQ(outcome.code, 0) << verb << outcome.err;
    fs::remove(saved);
    EXPECT_EQ(entries(), before) << verb;
    EXPECT_EQ(contentOf(store_), file) << verb;
  }
  auto open = MapStore::open(store_, MapStore::Mode::kOpen);
  ASSERT_TRUE(open);
  const auto written = entries();
  EXPECT_EQ(fleet("info " + store_).code, 0);
  EXPECT_EQ(entries(), written) << "a log that is in use stays";
  EXPECT_TRUE(open->setMeta("version", "v"));
}

TEST_F(RepairVerbs, finishSaysThatAStoreWasBroughtToThisRelease) {
  fs::copy_file(std::string(COMAP_STORE_RELEASES) + "/0.1.0.comap", store_);
  {
    auto database = Database::open(store_, SQLITE_OPEN_READWRITE);
    ASSERT_TRUE(database && database->execute("INSERT OR REPLACE INTO meta (key, value) VALUES ('complete', 'yes')"));
  }
  const Outcome first = fleet("finish " + store_), second = fleet("finish " + store_);
  EXPECT_EQ(first.code, 0) << first.err;
  EXPECT_EQ(first.out, store_ + ": brought from schema version 3 to 4\n" + store_ +
                           ": nothing else to do, poses and tiles are final\n");
  EXPECT_NE(first.err.find("is of schema version 3, of an earlier release"), std::string::npos) << first.err;
  EXPECT_EQ(second.out, store_ + ": nothing to do, poses and tiles are final\n");
  EXPECT_EQ(second.err, "");
}

// Of a log that is none, SQLite makes an index for whoever reads.
TEST_F(RepairVerbs, aLogThatIsNoneGetsNoIndex) {
  fillWhole();
  std::ofstream(store_ + "-wal", std::ios::binary) << std::string(5000, 'x');
  const auto before = entries();
  for (const std::string verb : {"info ", "merges ", "doctor ", "doctor --full "}) {
    (void)fleet(verb + store_);
    EXPECT_EQ(entries(), before) << verb;
  }
  (void)fleet("recover --later " + store_ + " --out " + (folder_ / "saved.comap").string());
  EXPECT_FALSE(entries().contains("map.comap-shm"));
}

TEST_F(RepairVerbs, whatIsWrongInTheHeadIsNamedAndMendedInWhatIsSaved) {
  fillWhole();
  const std::string whole = contentOf(store_);
  for (const size_t at : {18u, 20u, 44u, 56u, 59u, 64u}) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x54);
    std::ofstream(store_, std::ios::binary) << damaged;
    const Outcome looked = fleet("doctor " + store_);
    EXPECT_EQ(looked.code, 1) << at;
    EXPECT_NE(looked.out.find("damage: the file's head, byte "), std::string::npos) << looked.out;
    const std::string saved = (folder_ / "saved.comap").string();
    const Outcome recovered = fleet("recover --later " + store_ + " --out " + saved);
    EXPECT_EQ(recovered.code, 0) << at << recovered.err;
    EXPECT_NE(recovered.out.find("whole: 1 keyframes"), std::string::npos) << recovered.out;
    EXPECT_EQ(fleet("doctor " + saved).code, 0);
    EXPECT_TRUE(contentOf(store_) == damaged) << "the source stays as it is";
    fs::remove(saved);
  }
}

TEST_F(RepairVerbs, ofAFileThatIsCutOffTheMissingPagesAreCounted) {
  fillWhole();
  fs::resize_file(store_, 16384);
  EXPECT_NE(fleet("doctor " + store_).out.find(" pages are missing"), std::string::npos);
  const Outcome recovered = fleet("recover --later " + store_ + " --out " + (folder_ / "saved.comap").string());
  EXPECT_EQ(recovered.code, 1);
  EXPECT_NE(recovered.err.find(" pages are missing"), std::string::npos) << recovered.err;
}

TEST_F(RepairVerbs, aRefusedChangeLeavesEveryByte) {
  fill(1);
  const std::string whole = contentOf(store_);
  for (const std::string& command : {"split " + store_ + " 9 --later", "split " + store_ + " 1 --undo --later",
                                     "forget " + store_ + " nobody --later"}) {
    EXPECT_EQ(fleet(command).code, 2) << command;
    EXPECT_TRUE(contentOf(store_) == whole) << command;
  }
}

}  // namespace
}  // namespace comap
