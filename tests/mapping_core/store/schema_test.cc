// Stores of earlier releases, and the steps that bring them to this one.
#include "mapping_core/store/schema.h"

#include <array>

#include "mapping_core/store/store_glance.h"
#include "mapping_core/store/store_survey.h"
#include "tests/files/temporary_folder.h"
#include "tests/mapping_core/store/store_fixture.h"

namespace comap {
namespace {

const std::filesystem::path kReleases = COMAP_STORE_RELEASES;

class SchemaTest : public StoreTest {
 protected:
  static MatchVerdict verdict() {
    return {idOf(1), idOf(2, "bravo"), true,       "accepted", 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9,
            0.95,    poseOf(1),        matrixOf(1)};
  }
  static MergeRecord merge() {
    MergeRecord record;
    record.number = 1;
    record.kept = "alpha-1-0";
    record.absorbed = "bravo-1-7";
    record.T_kept_absorbed = poseOf(9);
    record.robots = {"alpha", "bravo"};
    record.voters = {idOf(1), idOf(2, "bravo")};
    record.keyframes_ingested = 17;
    return record;
  }
  static Edge edge() { return {idOf(0), idOf(1), EdgeKind::kLoop, poseOf(5), matrixOf(5)}; }

  Database writable() {
    auto database = Database::open(path_.string(), SQLITE_OPEN_READWRITE);
    EXPECT_TRUE(database) << database.error().text;
    return std::move(*database);
  }
};

// Run once for each release, with --gtest_also_run_disabled_tests, and add the file that it names to the releases.
TEST_F(SchemaTest, DISABLED_WriteAStoreOfThisRelease) {
  path_ = std::filesystem::temp_directory_path() / (COMAP_VERSION ".comap");
  std::filesystem::remove(path_);
  auto store = create();
  ASSERT_TRUE(store);
  ASSERT_TRUE(store->addKeyframe(idOf(0), 1, bytesOf(1, 300)));
  ASSERT_TRUE(store->addKeyframe(idOf(2, "bravo"), 2, bytesOf(2, 200)));
  ASSERT_TRUE(store->setPoses("alpha-1-0", {{idOf(0), poseOf(3)}}));
  ASSERT_TRUE(store->addEdge(edge()));
  ASSERT_TRUE(store->addVerdict(verdict()));
  ASSERT_TRUE(store->addMerge(merge()));
  const std::vector<Tile> tiles{tileOf("alpha-1-0", 1, -2, 3, 50, 4)};
  ASSERT_TRUE(store->setTiles(tiles));
  ASSERT_TRUE(store->setMeta("complete", "yes"));
  std::printf("written: %s\n", path_.c_str());
}

TEST_F(SchemaTest, StoresOfAllReleasesAreReadWhole) {
  size_t releases = 0;
  for (const auto& file : std::filesystem::directory_iterator(kReleases)) {
    SCOPED_TRACE(file.path().string());
    ++releases;
    std::filesystem::copy_file(file.path(), path_, std::filesystem::copy_options::overwrite_existing);
    auto store = create();  // to be written: what an upgraded core does
    ASSERT_TRUE(store) << store.error().text;
    const auto keyframes = store->keyframes();
    ASSERT_TRUE(keyframes) << keyframes.error().text;
    ASSERT_EQ(keyframes->size(), 2u);
    EXPECT_EQ((*keyframes)[0].map, "alpha-1-0");
    expectSame((*keyframes)[0].T_map_cam, poseOf(3));
    EXPECT_EQ((*keyframes)[1].map, "");
    EXPECT_EQ(*store->encodedKeyframe(idOf(0)), bytesOf(1, 300));
    const auto edges = store->edges();
    ASSERT_EQ(edges->size(), 1u);
    EXPECT_EQ(edges->front().information, edge().information);
    expectSame(edges->front().T_from_to, edge().T_from_to);
    const auto verdicts = store->verdicts();
    ASSERT_EQ(verdicts->size(), 1u);
    EXPECT_EQ(verdicts->front().reason, "accepted");
    EXPECT_EQ(verdicts->front().unlike, verdict().unlike);
    EXPECT_EQ(verdicts->front().information, verdict().information);
    expectSame(verdicts->front().T_candidate_query, verdict().T_candidate_query);
    const auto merges = store->merges();
    ASSERT_EQ(merges->size(), 1u);
    EXPECT_EQ(merges->front().voters, merge().voters);
    const auto tiles = store->tiles("alpha-1-0");
    ASSERT_EQ(tiles->size(), 1u);
    EXPECT_EQ(tiles->front().surfels, tileOf("alpha-1-0", 1, -2, 3, 50, 4).surfels);
    EXPECT_TRUE(*store->addKeyframe(idOf(5), 3, bytesOf(6, 10)));
  }
  EXPECT_GE(releases, 1u);
}

// Looked at, saved from damage, but not read for what is in it until it is brought to the newest schema.
TEST_F(SchemaTest, AnOlderStoreIsLookedAtAndSavedAsItIs) {
  for (const auto& file : std::filesystem::directory_iterator(kReleases)) {
    SCOPED_TRACE(file.path().string());
    std::filesystem::copy_file(file.path(), path_, std::filesystem::copy_options::overwrite_existing);
    if (*writable().integer("PRAGMA user_version") == kStoreVersion) continue;
    const auto refused = read();
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kBadData);
    EXPECT_NE(refused.error().text.find("is of an older release"), std::string::npos) << refused.error().text;
    const std::string whole = contentOf(path_);
    const auto survey = surveyStore(path_);
    ASSERT_TRUE(survey) << survey.error().text;
    // The fixture's messages are noise, which no keyframe can be read from.
    EXPECT_EQ(survey->lost_keyframes, 2u);
    EXPECT_EQ(survey->merges.size(), 1u);
    EXPECT_EQ(survey->tiles, 1u);
    const auto glance = glanceAtStore(path_);
    ASSERT_TRUE(glance) << glance.error().text;
    EXPECT_EQ(glance->edges, 1u);
    for (const std::string& damage : glance->damage)
      EXPECT_EQ(damage.find("checksum is not"), std::string::npos) << damage;
    EXPECT_EQ(contentOf(path_), whole);
  }
}

// What is for speed alone is made for stores that lack it, and is no part of their version.
TEST_F(SchemaTest, IndexesAreMadeWhereTheyAreMissing) {
  const char* count = "SELECT count(*) FROM sqlite_schema WHERE name IN ('edges_withdrawn_by_kind', 'edges_of_merges')";
  ASSERT_TRUE(create()->addEdge(edge()));
  ASSERT_TRUE(
      writable().execute("DROP INDEX edges_withdrawn_by_kind; DROP INDEX edges_of_merges; "
                         "CREATE INDEX edges_withdrawn ON edges (withdrawn_by) WHERE withdrawn_by <> 0"));
  EXPECT_EQ(read()->edgeCounts()->holding[static_cast<size_t>(EdgeKind::kLoop)], 1u) << "read without them, too";
  EXPECT_EQ(*writable().integer(count), 0);
  ASSERT_TRUE(create());
  EXPECT_EQ(*writable().integer(count), 2);
  EXPECT_EQ(*writable().integer("SELECT count(*) FROM sqlite_schema WHERE name = 'edges_withdrawn'"), 0);
  EXPECT_EQ(*writable().integer("PRAGMA user_version"), kStoreVersion);
}

TEST_F(SchemaTest, AnOlderStoreBecomesOneLikeANewOne) {
  for (const auto& file : std::filesystem::directory_iterator(kReleases)) {
    SCOPED_TRACE(file.path().string());
    std::filesystem::copy_file(file.path(), path_, std::filesystem::copy_options::overwrite_existing);
    ASSERT_TRUE(create());
    Database database = writable();
    EXPECT_TRUE(*isSchema(database));
    EXPECT_EQ(*database.integer("SELECT count(*) FROM pragma_foreign_key_check"), 0);
    EXPECT_EQ(*database.integer("SELECT count(*) FROM pragma_integrity_check WHERE integrity_check <> 'ok'"), 0);
    auto store = create();
    EXPECT_EQ(*store->removeRobot("bravo"), 1u) << "what hung on it went as well";
    EXPECT_EQ(store->keyframes()->size(), 1u);
  }
}

constexpr std::array<Migration, 2> kSteps{
    {{kStoreVersion, "ALTER TABLE keyframes ADD COLUMN note TEXT NOT NULL DEFAULT 'none'"},
     {kStoreVersion + 1, "CREATE TABLE extra (number INTEGER PRIMARY KEY) STRICT; INSERT INTO extra VALUES (7)"}}};

TEST_F(SchemaTest, ItIsKnownByItsWords) {
  ASSERT_TRUE(create());
  Database database = writable();
  EXPECT_TRUE(*isSchema(database));
  for (const auto& [change, is] :
       {std::pair("DROP INDEX edges_of_merges", true), std::pair("CREATE TABLE other (a)", false),
        std::pair("DROP TABLE other", true), std::pair("ALTER TABLE poses ADD COLUMN note TEXT", false),
        std::pair("ALTER TABLE poses DROP COLUMN note", true), std::pair("DROP TABLE tiles", false)}) {
    ASSERT_TRUE(database.execute(change)) << change;
    EXPECT_EQ(*isSchema(database), is) << change;
  }
}

TEST_F(SchemaTest, StepsAreTakenInOrder) {
  ASSERT_TRUE(create()->addKeyframe(idOf(0), 1, bytesOf(1, 300)));
  Database database = writable();
  ASSERT_TRUE(migrateSchema(database, kSteps, kStoreVersion + 2));
  EXPECT_EQ(*database.integer("PRAGMA user_version"), kStoreVersion + 2);
  EXPECT_EQ(*database.integer("SELECT count(*) FROM keyframes WHERE note = 'none'"), 1);
  EXPECT_EQ(*database.integer("SELECT number FROM extra"), 7);
  ASSERT_TRUE(migrateSchema(database, kSteps, kStoreVersion + 2)) << "there already";
}

TEST_F(SchemaTest, AStepThatFailsLeavesTheStoreAsItWas) {
  ASSERT_TRUE(create()->addKeyframe(idOf(0), 1, bytesOf(1, 300)));
  constexpr std::array<Migration, 2> kBroken{{kSteps[0], {kStoreVersion + 1, "CREATE TABLE keyframes (a)"}}};
  {
    Database database = writable();
    EXPECT_FALSE(migrateSchema(database, kBroken, kStoreVersion + 2));
    EXPECT_EQ(*database.integer("PRAGMA user_version"), kStoreVersion);
    EXPECT_EQ(*database.integer("SELECT count(*) FROM pragma_table_info('keyframes') WHERE name = 'note'"), 0);
  }
  EXPECT_EQ(create()->keyframes()->size(), 1u);
}

TEST_F(SchemaTest, AMissingStepIsSaid) {
  ASSERT_TRUE(create());
  Database database = writable();
  const auto refused = migrateSchema(database, kSteps, kStoreVersion + 3);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kBadData);
  EXPECT_EQ(*database.integer("PRAGMA user_version"), kStoreVersion);
}

}  // namespace
}  // namespace comap
