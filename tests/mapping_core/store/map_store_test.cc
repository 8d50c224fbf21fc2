#include "mapping_core/store/map_store.h"

#include <sqlite3.h>

#include <cmath>
#include <limits>

#include "protocol/storage/database.h"
#include "tests/mapping_core/store/store_fixture.h"

namespace comap {
namespace {

class MapStoreTest : public StoreTest {};

TEST_F(MapStoreTest, keyframesComeBackInOrderOfArrival) {
  const KeyframeId first = idOf(7, "bravo"), second = idOf(0), third = idOf(1, "bravo");
  {
    auto store = create();
    ASSERT_TRUE(store) << store.error().text;
    ASSERT_TRUE(*store->addKeyframe(first, -5, bytesOf(1, 300000)));
    ASSERT_TRUE(*store->addKeyframe(second, 1, bytesOf(2, 10)));
    ASSERT_TRUE(*store->addKeyframe(third, 2, {}));
    const auto again = store->addKeyframe(first, 99, bytesOf(9, 5));
    ASSERT_TRUE(again);
    EXPECT_FALSE(*again) << "known already, and not touched";
    ASSERT_TRUE(store->setPoses("bravo-1-7", {{first, poseOf(1)}, {third, poseOf(2)}}));
    ASSERT_TRUE(store->setPoses("alpha-1-0", {{third, poseOf(3)}}));
  }
  auto store = read();
  ASSERT_TRUE(store) << store.error().text;
  const auto keyframes = store->keyframes();
  ASSERT_TRUE(keyframes) << keyframes.error().text;
  ASSERT_EQ(keyframes->size(), 3u);
  EXPECT_EQ((*keyframes)[0].id, first);
  EXPECT_EQ((*keyframes)[0].stamp_ns, -5);
  EXPECT_EQ((*keyframes)[0].bytes, 300000u);
  EXPECT_EQ((*keyframes)[0].map, "bravo-1-7");
  expectSame((*keyframes)[0].T_map_cam, poseOf(1));
  EXPECT_EQ((*keyframes)[1].id, second);
  EXPECT_EQ((*keyframes)[1].arrival, 1u);
  EXPECT_EQ((*keyframes)[1].map, "") << "no pose yet";
  EXPECT_EQ((*keyframes)[2].map, "alpha-1-0") << "moved to another map";
  expectSame((*keyframes)[2].T_map_cam, poseOf(3));
  EXPECT_EQ(*store->encodedKeyframe(first), bytesOf(1, 300000));
  EXPECT_TRUE(store->encodedKeyframe(third)->empty());
  EXPECT_EQ(store->encodedKeyframe(idOf(99)).error().code, ErrorCode::kWrongUse);
  EXPECT_EQ(*store->robots(), (std::vector<std::string>{"bravo", "alpha"}));
}

// A store is switched to its log when it is opened to write, and back when it is closed: by a change of its own.
TEST_F(MapStoreTest, WhoOnlyReadsIsNotStoppedByAChangeThatWasHalfDone) {
  { ASSERT_TRUE(*create()->addKeyframe(idOf(0), 1, bytesOf(1, 100))); }
  const std::string whole = path_, killed = whole + ".killed";
  {
    auto database = Database::open(whole, SQLITE_OPEN_READWRITE);
    ASSERT_TRUE(database && database->execute("PRAGMA cache_size = 1; PRAGMA cache_spill = 1; BEGIN; "
                                              "DELETE FROM keyframes; CREATE TABLE half (a); INSERT INTO half "
                                              "VALUES (zeroblob(100000)); DROP TABLE half"));
    for (const char* part : {"", "-journal"}) std::filesystem::copy_file(whole + part, killed + part);
    ASSERT_TRUE(database->execute("ROLLBACK"));
  }
  const auto store = MapStore::open(killed, MapStore::Mode::kReadOnly);
  ASSERT_TRUE(store) << store.error().text;
  EXPECT_EQ(store->keyframes()->size(), 1u);
}

TEST_F(MapStoreTest, edgesComeBackToTheBit) {
  auto store = create();
  ASSERT_TRUE(store);
  std::vector<Edge> edges;
  for (uint32_t i = 0; i < 6; ++i) {
    edges.push_back({idOf(i), idOf(i + 1, "bravo"), static_cast<EdgeKind>(i % kEdgeKinds), poseOf(i), matrixOf(i)});
    ASSERT_TRUE(store->addEdge(edges.back()));
  }
  edges[2].information = matrixOf(77);
  ASSERT_TRUE(store->addEdge(edges[2])) << "a better estimate of a known tie";
  const auto back = read()->edges();
  ASSERT_TRUE(back) << back.error().text;
  ASSERT_EQ(back->size(), edges.size());
  for (size_t i = 0; i < edges.size(); ++i) {
    EXPECT_EQ((*back)[i].from, edges[i].from);
    EXPECT_EQ((*back)[i].to, edges[i].to);
    EXPECT_EQ((*back)[i].kind, edges[i].kind);
    EXPECT_EQ((*back)[i].information, edges[i].information);
    expectSame((*back)[i].T_from_to, edges[i].T_from_to);
  }
}

TEST_F(MapStoreTest, verdictsKeepEveryNumber) {
  auto store = create();
  ASSERT_TRUE(store);
  MatchVerdict verdict{idOf(1), idOf(2, "bravo"), true,       "accepted", 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9,
                       0.95,    poseOf(1),        matrixOf(1)};
  ASSERT_TRUE(store->addVerdict(verdict));
  MatchVerdict odd{idOf(3), idOf(4), false, "it's \"odd\"; DROP TABLE verdicts", 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, {}, {}};
  odd.rms_sigma = std::numeric_limits<double>::quiet_NaN();
  odd.degeneracy = std::numeric_limits<double>::infinity();
  ASSERT_TRUE(store->addVerdict(odd));
  ASSERT_TRUE(store->addVerdict(verdict)) << "the same pair may be judged again";
  const auto back = read()->verdicts();
  ASSERT_TRUE(back) << back.error().text;
  ASSERT_EQ(back->size(), 3u);
  const MatchVerdict& v = (*back)[0];
  EXPECT_EQ(v.query, verdict.query);
  EXPECT_EQ(v.candidate, verdict.candidate);
  EXPECT_TRUE(v.accepted);
  EXPECT_EQ(v.reason, "accepted");
  EXPECT_EQ((std::array{v.fern_dissimilarity, v.inlier_ratio, v.rms_sigma, v.degeneracy, v.photometric_median,
                        v.seen_through, v.unlike, v.features, v.round_trip_m, v.round_trip_rad}),
            (std::array{0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95}));
  expectSame(v.T_candidate_query, verdict.T_candidate_query);
  EXPECT_EQ(v.information, verdict.information);
  EXPECT_EQ((*back)[1].reason, odd.reason);
  EXPECT_FALSE((*back)[1].accepted);
  EXPECT_TRUE(std::isnan((*back)[1].rms_sigma));
  EXPECT_TRUE(std::isinf((*back)[1].degeneracy));
}

TEST_F(MapStoreTest, mergesKeepRobotsAndVoters) {
  auto store = create();
  ASSERT_TRUE(store);
  const MergeRecord merge{4,  "alpha-1-0", "bravo-1-0", poseOf(1), {"alpha", "bravo"}, {idOf(5), idOf(3, "bravo")},
                          17, {}};
  ASSERT_TRUE(store->addMerge(merge));
  MergeRecord other = merge;
  other.number = 2;
  other.voters.clear();
  ASSERT_TRUE(store->addMerge(other));
  ASSERT_TRUE(store->addMerge(merge)) << "written again after a restart";
  const auto back = read()->merges();
  ASSERT_TRUE(back) << back.error().text;
  ASSERT_EQ(back->size(), 2u);
  EXPECT_EQ((*back)[0].number, 2u);
  EXPECT_TRUE((*back)[0].voters.empty());
  EXPECT_EQ((*back)[1].kept, "alpha-1-0");
  EXPECT_EQ((*back)[1].absorbed, "bravo-1-0");
  EXPECT_EQ((*back)[1].robots, merge.robots);
  EXPECT_EQ((*back)[1].voters, merge.voters);
  EXPECT_EQ((*back)[1].keyframes_ingested, 17u);
  expectSame((*back)[1].T_kept_absorbed, merge.T_kept_absorbed);
}

TEST_F(MapStoreTest, withdrawnEdgesAndUndoneMergesAreKeptApart) {
  auto store = create();
  ASSERT_TRUE(store);
  Edge edge{idOf(1), idOf(2, "bravo"), EdgeKind::kInterRobot, poseOf(1), matrixOf(1), 4};
  const Edge loop{idOf(1), idOf(2), EdgeKind::kLoop, poseOf(2), matrixOf(2), 0};
  ASSERT_TRUE(store->addEdge(edge));
  ASSERT_TRUE(store->addEdge(loop));
  ASSERT_TRUE(store->withdrawEdge(edge, 3));
  auto holding = store->edges();
  ASSERT_TRUE(holding);
  ASSERT_EQ(holding->size(), 1u);
  EXPECT_EQ((*holding)[0].kind, EdgeKind::kLoop);
  const auto withdrawn = read()->withdrawnEdges();
  ASSERT_TRUE(withdrawn) << withdrawn.error().text;
  ASSERT_EQ(withdrawn->size(), 1u);
  EXPECT_EQ((*withdrawn)[0].withdrawn_by, 3u);
  EXPECT_EQ((*withdrawn)[0].edge.merge, 4u);
  EXPECT_EQ((*withdrawn)[0].edge.information, edge.information);
  const auto counts = read()->edgeCounts();
  ASSERT_TRUE(counts) << counts.error().text;
  EXPECT_EQ(counts->withdrawn, 1u);
  EXPECT_EQ(counts->holding, (std::array<size_t, kEdgeKinds>{0, 1, 0, 0}));
  ASSERT_TRUE(store->withdrawEdge(edge, 0));
  EXPECT_EQ(store->edges()->size(), 2u);
  EXPECT_EQ(store->edgeCounts()->holding, (std::array<size_t, kEdgeKinds>{0, 1, 1, 0}));
  edge.to.sequence = 99;
  EXPECT_EQ(store->withdrawEdge(edge, 1).error().code, ErrorCode::kWrongUse);

  for (const uint32_t number : {3u, 4u})
    ASSERT_TRUE(store->addMerge({number, "a", "b", {}, {"alpha"}, {idOf(1)}, 3, {}}));
  ASSERT_TRUE(store->undoMerge(3, "walls disagree", 3));
  ASSERT_TRUE(store->undoMerge(4, "with it", 3));
  EXPECT_EQ(read()->merges()->front().undone, "walls disagree");
  EXPECT_EQ(*store->mergesUndoneBy(3), (std::vector<uint32_t>{3, 4}));
  ASSERT_TRUE(store->undoMerge(3, "", 0));
  EXPECT_EQ(*store->mergesUndoneBy(3), std::vector<uint32_t>{4});
  EXPECT_TRUE(store->merges()->front().undone.empty());
  EXPECT_EQ(store->undoMerge(9, "x", 9).error().code, ErrorCode::kWrongUse);
}

TEST_F(MapStoreTest, aTransactionHoldsAsAWholeOrNotAtAll) {
  auto store = create();
  ASSERT_TRUE(store);
  ASSERT_TRUE(store->addKeyframe(idOf(0), 0, bytesOf(1, 10)));
  {
    auto abandoned = store->begin();
    ASSERT_TRUE(abandoned);
    ASSERT_TRUE(store->setPoses("m", {{idOf(0), poseOf(1)}}));
    ASSERT_TRUE(store->addMerge({1, "a", "b", {}, {"alpha"}, {idOf(1)}, 3, {}}));
    EXPECT_EQ(store->merges()->size(), 1u);
  }
  EXPECT_TRUE(store->merges()->empty());
  EXPECT_TRUE(store->keyframes()->front().map.empty());
  auto kept = store->begin();
  ASSERT_TRUE(kept);
  ASSERT_TRUE(store->addMerge({1, "a", "b", {}, {"alpha"}, {idOf(1)}, 3, {}}));
  EXPECT_FALSE(store->setPoses("m", {{idOf(0), poseOf(1)}, {idOf(7), poseOf(1)}}));
  ASSERT_TRUE(kept->commit());
  EXPECT_EQ(read()->merges()->size(), 1u);
  EXPECT_TRUE(read()->keyframes()->front().map.empty()) << "what failed within it left nothing";
}

TEST_F(MapStoreTest, aTransactionThatDoesNotWaitForTheDiskHoldsAsAWholeToo) {
  auto store = create();
  ASSERT_TRUE(store);
  ASSERT_TRUE(store->addKeyframe(idOf(0), 0, bytesOf(1, 10)));
  {
    auto abandoned = store->begin(Durable::kWithNext);
    ASSERT_TRUE(abandoned);
    ASSERT_TRUE(store->setPoses("m", {{idOf(0), poseOf(1)}}));
  }
  EXPECT_TRUE(store->keyframes()->front().map.empty());
  {
    auto outer = store->begin(Durable::kWithNext);
    ASSERT_TRUE(outer);
    auto inner = store->begin(Durable::kWithNext);
    ASSERT_TRUE(inner);
    ASSERT_TRUE(store->setPoses("m", {{idOf(0), poseOf(1)}}));
    ASSERT_TRUE(inner->commit());
    EXPECT_TRUE(read()->keyframes()->front().map.empty());
    ASSERT_TRUE(outer->commit());
    EXPECT_EQ(read()->keyframes()->front().map, "m") << "for others at once";
  }
  ASSERT_TRUE(store->addKeyframe(idOf(1), 0, bytesOf(2, 10)));
  EXPECT_EQ(read()->keyframes()->size(), 2u);
}

TEST_F(MapStoreTest, tilesAreReplacedAsAWhole) {
  auto store = create();
  ASSERT_TRUE(store);
  const std::vector<Tile> first = {tileOf("a", -3, 2, 0, 1000, 1), tileOf("a", 5, -9, 1, 1, 2),
                                   tileOf("b", 0, 0, INT32_MIN, 50, 3)};
  ASSERT_TRUE(store->setTiles(first));
  EXPECT_EQ(*store->tiles(""), first);
  EXPECT_EQ(*store->tiles("b"), std::vector<Tile>{first[2]});
  EXPECT_TRUE(store->tiles("c")->empty());
  const auto sizes = store->mapSizes();
  ASSERT_TRUE(sizes);
  EXPECT_EQ(sizes->at("a").tiles, 2u);
  EXPECT_EQ(sizes->at("a").surfels, 1001u);
  EXPECT_EQ(sizes->at("b").surfels, 50u);
  const std::vector<Tile> second = {tileOf("a", -3, 2, 0, 10, 9)};
  ASSERT_TRUE(store->setTiles(second));
  EXPECT_EQ(*read()->tiles(""), second);
  const std::vector<Tile> twice = {second[0], second[0]};
  EXPECT_FALSE(store->setTiles(twice));
  EXPECT_EQ(*store->tiles(""), second) << "a failed call must change nothing";
}

TEST_F(MapStoreTest, posesOfAnUnknownKeyframeChangeNothing) {
  auto store = create();
  ASSERT_TRUE(store);
  ASSERT_TRUE(*store->addKeyframe(idOf(0), 0, {}));
  ASSERT_TRUE(store->setPoses("m", {{idOf(0), poseOf(1)}}));
  const auto refused = store->setPoses("n", {{idOf(0), poseOf(2)}, {idOf(1), poseOf(3)}});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kWrongUse);
  EXPECT_NE(refused.error().text.find("alpha/18364758544493064720/1"), std::string::npos) << refused.error().text;
  EXPECT_EQ(store->keyframes()->at(0).map, "m");
}

TEST_F(MapStoreTest, metaIsSetAndReplaced) {
  auto store = create();
  ASSERT_TRUE(store);
  EXPECT_EQ(*store->meta("version"), "");
  ASSERT_TRUE(store->setMeta("version", "0.1"));
  ASSERT_TRUE(store->setMeta("version", "0.2"));
  EXPECT_EQ(*read()->meta("version"), "0.2");
}

TEST_F(MapStoreTest, peopleCanQueryItWithSqlite) {
  auto store = create();
  ASSERT_TRUE(store);
  MatchVerdict verdict;
  verdict.query = idOf(1);
  verdict.candidate = idOf(2);
  verdict.reason = "degenerate";
  ASSERT_TRUE(store->addVerdict(verdict));
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open_v2(path_.c_str(), &db, SQLITE_OPEN_READONLY, nullptr), SQLITE_OK);
  sqlite3_stmt* statement = nullptr;
  ASSERT_EQ(sqlite3_prepare_v2(db, "SELECT count(*) FROM verdicts WHERE reason = 'degenerate' AND NOT accepted", -1,
                               &statement, nullptr),
            SQLITE_OK)
      << sqlite3_errmsg(db);
  ASSERT_EQ(sqlite3_step(statement), SQLITE_ROW);
  EXPECT_EQ(sqlite3_column_int(statement, 0), 1);
  sqlite3_finalize(statement);
  sqlite3_close(db);
}

TEST_F(MapStoreTest, aReaderSeesWhatAWriterAddsMeanwhile) {
  auto writer = create();
  ASSERT_TRUE(writer);
  auto reader = read();
  ASSERT_TRUE(reader) << reader.error().text;
  EXPECT_TRUE(reader->keyframes()->empty());
  ASSERT_TRUE(*writer->addKeyframe(idOf(0), 0, bytesOf(1, 1000)));
  EXPECT_EQ(reader->keyframes()->size(), 1u);
  const auto refused = reader->setMeta("a", "b");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kUnreachable);
  EXPECT_NE(refused.error().text.find("reading only"), std::string::npos) << refused.error().text;
}

TEST_F(MapStoreTest, aClosedStoreIsOneFileAndReadingItLeavesNothingBehind) {
  {
    auto store = create();
    ASSERT_TRUE(store);
    ASSERT_TRUE(*store->addKeyframe(idOf(0), 0, bytesOf(1, 1000)));
  }
  { EXPECT_EQ(read()->keyframes()->size(), 1u); }
  for (const auto& entry : std::filesystem::directory_iterator(folder_)) EXPECT_EQ(entry.path(), path_);
  auto again = create();
  ASSERT_TRUE(again);
  ASSERT_TRUE(*again->addKeyframe(idOf(1), 0, bytesOf(1, 1000)));
  EXPECT_TRUE(std::filesystem::exists(path_.string() + "-wal")) << "a store that is written keeps a log";
}

TEST_F(MapStoreTest, anOpenStoreMoves) {
  auto opened = create();
  ASSERT_TRUE(opened);
  MapStore store = std::move(*opened);
  ASSERT_TRUE(*store.addKeyframe(idOf(0), 0, bytesOf(1, 10)));
  MapStore other = std::move(store);
  EXPECT_EQ(other.keyframes()->size(), 1u);
}

}  // namespace
}  // namespace comap
