// Stores that are damaged page by page: what is whole is found, told apart from what is not, and saved.
#include "mapping_core/store/store_survey.h"

#include <gmock/gmock.h>
#include <sqlite3.h>

#include <algorithm>
#include <atomic>
#include <optional>
#include <thread>

#include "mapping_core/store/store_glance.h"
#include "protocol/codec/keyframe_codec.h"
#include "protocol/storage/row_sum.h"
#include "tests/files/temporary_folder.h"
#include "tests/mapping_core/store/store_fixture.h"

namespace comap {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr size_t kPageBytes = 4096;
constexpr uint32_t kKeyframes = 12;

class StoreSurveyTest : public StoreTest {
 protected:
  // Noise, so that a message takes some pages.
  static std::vector<uint8_t> messageOf(uint32_t sequence) {
    std::mt19937 engine(sequence);
    Keyframe keyframe;
    keyframe.id = idOf(sequence);
    keyframe.stamp_ns = sequence;
    keyframe.camera = {60, 60, 32, 24, 64, 48};
    keyframe.colour = ColourImage(64, 48);
    keyframe.depth = DepthImage(64, 48);
    for (int y = 0; y < 48; ++y)
      for (int x = 0; x < 64; ++x) keyframe.depth.at(x, y) = static_cast<uint16_t>(5000 + engine() % 9000);
    keyframe.linked = sequence > 0;
    keyframe.linked_to = sequence > 0 ? sequence - 1 : 0;
    keyframe.T_link_this = poseOf(sequence);
    const auto encoded = encodeKeyframe(keyframe);
    EXPECT_TRUE(encoded) << (encoded ? "" : encoded.error().text);
    return encoded ? *encoded : std::vector<uint8_t>();
  }
  void fill() {
    auto store = create();
    ASSERT_TRUE(store);
    for (uint32_t i = 0; i < kKeyframes; ++i) {
      ASSERT_TRUE(*store->addKeyframe(idOf(i), i, messageOf(i)));
      ASSERT_TRUE(store->setPoses("m", {{idOf(i), poseOf(i)}}));
      if (i > 0) {
        ASSERT_TRUE(store->addEdge({idOf(i - 1), idOf(i), EdgeKind::kOdometry, poseOf(200 + i), Matrix6d::Identity()}));
      }
      if (i > 1) {
        MatchVerdict verdict;
        verdict.query = idOf(i);
        verdict.candidate = idOf(i - 2);
        verdict.reason = "overlap";
        verdict.inlier_ratio = 0.5 + 0.013 * i;
        verdict.rms_sigma = 0.7 + 0.017 * i;
        verdict.T_candidate_query = poseOf(100 + i);
        verdict.information = matrixOf(i);
        ASSERT_TRUE(store->addVerdict(verdict));
      }
    }
    ASSERT_TRUE(store->addMerge({1, "a", "b", poseOf(50), {"alpha"}, {idOf(1)}, 3, {}}));
    ASSERT_TRUE(store->setMeta("version", "v"));
    std::vector<Tile> tiles;
    for (int i = 0; i < 6; ++i) tiles.push_back(tileOf("m", i, 0, 0, 800, uint32_t(i)));
    ASSERT_TRUE(store->setTiles(tiles));
  }
  void sql(const char* statement) {
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open(path_.c_str(), &db), SQLITE_OK);
    ASSERT_EQ(addRowSum(db), SQLITE_OK);
    ASSERT_EQ(sqlite3_exec(db, statement, nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(db);
    sqlite3_close(db);
  }
  // All of a store, in words. Nothing if SQLite cannot read it all.
  static std::optional<std::vector<std::string>> readableRowsOf(const std::string& path) {
    sqlite3* db = nullptr;
    EXPECT_EQ(sqlite3_open(path.c_str(), &db), SQLITE_OK);
    std::vector<std::string> rows;
    bool readable = true;
    const auto add = [](void* to, int columns, char** values, char**) {
      std::string& row = static_cast<std::vector<std::string>*>(to)->emplace_back();
      for (int i = 0; i < columns; ++i) row += std::string(values[i] == nullptr ? "NULL" : values[i]) + " ";
      return 0;
    };
    for (const char* sql :
         {"SELECT name, sql FROM sqlite_schema ORDER BY name", "SELECT * FROM meta", "SELECT * FROM robots",
          "SELECT * FROM keyframes", "SELECT keyframe, hex(encoded) FROM keyframe_messages", "SELECT * FROM poses",
          "SELECT *, hex(numbers) FROM edges ORDER BY number", "SELECT *, hex(numbers) FROM verdicts",
          "SELECT * FROM merges", "SELECT * FROM merge_robots", "SELECT * FROM merge_voters",
          "SELECT count(*) FROM tiles"})
      readable = readable && sqlite3_exec(db, sql, add, &rows, nullptr) == SQLITE_OK;
    sqlite3_close(db);
    return readable ? std::optional(rows) : std::nullopt;
  }
  static std::vector<std::string> rowsOf(const std::string& path) {
    auto rows = readableRowsOf(path);
    EXPECT_TRUE(rows) << path;
    return rows.value_or(std::vector<std::string>());
  }
  int64_t number(const std::string& question) {
    sqlite3* db = nullptr;
    EXPECT_EQ(sqlite3_open(path_.c_str(), &db), SQLITE_OK);
    sqlite3_stmt* row = nullptr;
    EXPECT_EQ(sqlite3_prepare_v2(db, question.c_str(), -1, &row, nullptr), SQLITE_OK) << sqlite3_errmsg(db);
    const int64_t answer = sqlite3_step(row) == SQLITE_ROW ? sqlite3_column_int64(row, 0) : -1;
    sqlite3_finalize(row);
    sqlite3_close(db);
    return answer;
  }
  // Of each message the last page that it lies on, pages counted from 1, as SQLite itself tells. All have overflow.
  std::vector<int64_t> pagesNeeded() {
    sqlite3* db = nullptr;
    EXPECT_EQ(sqlite3_open(path_.c_str(), &db), SQLITE_OK);
    sqlite3_stmt* rows = nullptr;
    EXPECT_EQ(
        sqlite3_prepare_v2(db,
                           "SELECT max(o.pageno, l.pageno) FROM (SELECT substr(path, 1, instr(path, '+') - 1) AS "
                           "cell, max(pageno) AS pageno FROM dbstat WHERE name = 'keyframe_messages' AND pagetype "
                           "= 'overflow' GROUP BY 1) o JOIN dbstat l ON l.name = 'keyframe_messages' AND l.path = "
                           "substr(o.cell, 1, length(l.path)) AND l.pagetype = 'leaf' ORDER BY o.cell",
                           -1, &rows, nullptr),
        SQLITE_OK)
        << sqlite3_errmsg(db);
    std::vector<int64_t> pages;
    while (sqlite3_step(rows) == SQLITE_ROW) pages.push_back(sqlite3_column_int64(rows, 0));
    sqlite3_finalize(rows);
    sqlite3_close(db);
    return pages;
  }
  // Saves what is whole into a new store and looks at that. Whether it was copied before makes no difference.
  StoreSurvey saved(const StoreSurvey& survey) {
    const std::string path = folder_ / "saved.comap", second = folder_ / "copied.comap";
    for (const std::string& file : {path, second}) std::filesystem::remove(file);
    const bool copied = copyUnseen(survey.path, second);
    EXPECT_EQ(std::filesystem::exists(second), copied) << "no half copy is left";
    copies_ += copied;
    for (const auto& done : {saveWhole(survey, path), saveWhole(survey, second, copied)})
      EXPECT_TRUE(done) << (done ? "" : done.error().text);
    EXPECT_EQ(rowsOf(second), rowsOf(path));
    EXPECT_THAT(surveyStore(second)->damage, IsEmpty());
    auto again = surveyStore(path);
    EXPECT_TRUE(again) << (again ? "" : again.error().text);
    return again ? *again : StoreSurvey();
  }
  size_t copies_ = 0;  // that could be made
};

TEST_F(StoreSurveyTest, AWholeStoreIsWholeAndIsSavedWhole) {
  fill();
  const auto survey = surveyStore(path_);
  ASSERT_TRUE(survey) << survey.error().text;
  EXPECT_THAT(survey->damage, IsEmpty());
  EXPECT_THAT(survey->remarks, IsEmpty());
  for (const StoreSurvey& one : {*survey, saved(*survey)}) {
    EXPECT_THAT(one.damage, IsEmpty());
    EXPECT_EQ(one.keyframes.size(), kKeyframes);
    EXPECT_EQ(one.edges.size(), kKeyframes - 1);
    EXPECT_EQ(one.verdicts.size(), kKeyframes - 2);
    EXPECT_EQ(one.merges.size(), 1u);
    EXPECT_EQ(one.meta.at("version"), "v");
  }
  EXPECT_EQ(survey->tiles, 6u);
}

TEST_F(StoreSurveyTest, NothingIsSavedOfMergesThatAreLost) {
  fill();
  {
    auto store = create();
    ASSERT_TRUE(store->setGivenAgain(store->merges()->front().number, 3));
    ASSERT_TRUE(store->setGivenAgain(77, 3));
    ASSERT_TRUE(store->setMeta("compact_due", "yes"));
  }
  const StoreSurvey again = saved(*surveyStore(path_));
  EXPECT_TRUE(again.meta.contains("merge_given_again_1"));
  EXPECT_FALSE(again.meta.contains("merge_given_again_77"));
  EXPECT_FALSE(again.meta.contains("compact_due"));
}

// A core that writes while its store is looked at: no edge without its keyframes is ever seen.
TEST_F(StoreSurveyTest, AStoreThatIsWrittenMeanwhileIsWhole) {
  fill();
  std::atomic<bool> stop = false;
  auto store = create();
  std::thread core([&] {
    for (uint32_t i = kKeyframes; !stop; ++i) {
      auto together = store->begin();
      (void)bool(store->addKeyframe(idOf(i), i, messageOf(i)));
      (void)bool(store->addEdge({idOf(i - 1), idOf(i), EdgeKind::kOdometry, poseOf(i), Matrix6d::Identity()}));
      (void)bool(together->commit());
    }
  });
  for (int round = 0; round < 30; ++round) {
    EXPECT_THAT(surveyStore(path_)->damage, IsEmpty());
    EXPECT_THAT(glanceAtStore(path_)->damage, IsEmpty());
  }
  stop = true;
  core.join();
}

TEST_F(StoreSurveyTest, EachPageInTurn) {
  fill();
  std::string whole;
  {
    std::ifstream in(path_, std::ios::binary);
    whole.assign(std::istreambuf_iterator<char>(in), {});
  }
  const size_t pages = whole.size() / kPageBytes;
  ASSERT_GT(pages, 40u);
  size_t unreadable = 0, kept = 0, looked = 0;
  for (size_t page = 0; page < pages; page += page < 20 ? 1 : 5) {  // first those with tables' roots
    std::string damaged = whole;
    const std::vector<uint8_t> noise = bytesOf(uint32_t(page), kPageBytes);
    std::copy(noise.begin(), noise.end(), damaged.begin() + static_cast<std::ptrdiff_t>(page * kPageBytes));
    std::ofstream(path_, std::ios::binary) << damaged;
    const auto survey = surveyStore(path_);
    if (!survey) {
      ++unreadable;
      EXPECT_THAT(survey.error().text, HasSubstr(path_.string()));
      continue;
    }
    EXPECT_FALSE(survey->damage.empty()) << "page " << page << " is noise and nobody noticed";
    EXPECT_LE(survey->keyframes.size(), kKeyframes);
    const StoreSurvey again = saved(*survey);
    EXPECT_THAT(again.damage, IsEmpty()) << "page " << page;
    EXPECT_EQ(again.keyframes.size(), survey->keyframes.size()) << "page " << page;
    // What ties keyframes stands in their messages too.
    EXPECT_GE(again.edges.size() + 2 * (kKeyframes - again.keyframes.size()), kKeyframes - 1) << "page " << page;
    // Without SQLite's own check less is told, but no less is found, and nothing that is broken is copied.
    const auto rows = surveyStore(path_, {}, SurveyDepth::kRows);
    ASSERT_TRUE(rows) << "page " << page << ": " << rows.error().text;
    const StoreSurvey by_rows = saved(*rows);
    EXPECT_THAT(by_rows.damage, IsEmpty()) << "page " << page;
    EXPECT_EQ(by_rows.keyframes.size(), again.keyframes.size()) << "page " << page;
    EXPECT_EQ(by_rows.edges.size(), again.edges.size()) << "page " << page;
    EXPECT_EQ(by_rows.verdicts.size(), again.verdicts.size()) << "page " << page;
    EXPECT_EQ(by_rows.merges.size(), again.merges.size()) << "page " << page;
    kept += again.keyframes.size();
    ++looked;
  }
  EXPECT_GT(copies_, 0u) << "some damage SQLite does not come upon";
  EXPECT_LT(copies_, 2 * looked);
  EXPECT_LE(unreadable, 4u) << "only the pages with the schema hide all";
  EXPECT_GE(kept, looked * (kKeyframes - 2)) << "a page hides one keyframe, or all if it is the root of their table";
}

// An index that can be read but says something else than its table: the rows are saved, the index is made anew.
TEST_F(StoreSurveyTest, BytesOfIndexes) {
  fill();
  {
    auto store = create();
    Edge closure{idOf(1), idOf(4), EdgeKind::kLoop, poseOf(1), Matrix6d::Identity()};
    closure.merge = 1;
    ASSERT_TRUE(store->addEdge(closure));
    ASSERT_TRUE(store->withdrawEdge(closure, 1));
  }
  const std::string whole = contentOf(path_);
  for (const char* index : {"sqlite_autoindex_edges_1", "edges_withdrawn_by_kind", "edges_of_merges",
                            "verdicts_by_reason", "sqlite_autoindex_keyframes_1"}) {
    const int64_t page = number("SELECT pageno FROM dbstat WHERE pagetype = 'leaf' AND name = '" + std::string(index) +
                                "' ORDER BY pageno LIMIT 1");
    ASSERT_GT(page, 0) << index;
    size_t noticed = 0;
    for (size_t at = kPageBytes - 3; at > kPageBytes - 120; at -= 7) {  // where its entries are
      std::string damaged = whole;
      char& byte = damaged[size_t(page - 1) * kPageBytes + at];
      byte = static_cast<char>(byte ^ 1);
      std::ofstream(path_, std::ios::binary) << damaged;
      const auto survey = surveyStore(path_, {}, SurveyDepth::kRows);
      ASSERT_TRUE(survey) << survey.error().text;
      EXPECT_EQ(survey->edges.size(), kKeyframes) << index;
      EXPECT_EQ(survey->verdicts.size(), kKeyframes - 2) << index;
      noticed += !survey->damage.empty();
      const StoreSurvey again = saved(*survey);
      EXPECT_THAT(again.damage, IsEmpty()) << index << " " << at;
      EXPECT_EQ(again.keyframes.size(), kKeyframes) << index << " " << at;
      EXPECT_EQ(again.edges.size(), kKeyframes) << index << " " << at;
      EXPECT_EQ(again.verdicts.size(), kKeyframes - 2) << index << " " << at;
    }
    EXPECT_GE(noticed, 1u) << index;
    std::ofstream(path_, std::ios::binary) << whole;
  }
}

// SQLite itself would never write such rows; a damaged page can hold them.
TEST_F(StoreSurveyTest, ValuesOfAnotherTypeAreNotSaved) {
  fill();
  std::string damaged = contentOf(path_);
  // An edge's record: its header has a byte for its own length, one for each type and one more for that of the numbers;
  // that of `merge`, a 0 that takes no further bytes, becomes NULL.
  constexpr size_t kHeaderBytes = 14;
  const size_t kind = damaged.find("odometryalpha");
  ASSERT_NE(kind, std::string::npos);
  ASSERT_EQ(static_cast<size_t>(damaged[kind - kHeaderBytes]), kHeaderBytes);
  ASSERT_EQ(damaged.substr(kind - 3, 2), "\x08\x08");
  damaged[kind - 3] = 0;
  std::ofstream(path_, std::ios::binary) << damaged;
  for (const SurveyDepth depth : {SurveyDepth::kRows, SurveyDepth::kPages}) {
    const auto survey = surveyStore(path_, {}, depth);
    ASSERT_TRUE(survey) << survey.error().text;
    EXPECT_THAT(survey->damage, Contains(HasSubstr("a value of it is of another type than its column")));
    EXPECT_EQ(survey->edges.size(), kKeyframes - 2);
    const StoreSurvey again = saved(*survey);
    EXPECT_THAT(again.damage, IsEmpty());
    EXPECT_EQ(again.edges.size(), kKeyframes - 1) << "the tie stands in the keyframe's message too";
  }
}

// Whatever it is in, and however little it changes: a flipped bit that changes what a row says is noticed, by a glance,
// too, and what it is in is not saved as it is.
TEST_F(StoreSurveyTest, OneFlippedBit) {
  fill();
  const std::string whole = contentOf(path_);
  const auto rows = readableRowsOf(path_);
  std::mt19937 engine(11);
  size_t changed = 0;
  for (int flip = 0; flip < 1500; ++flip) {
    std::string damaged = whole;
    const size_t at = engine() % whole.size();
    damaged[at] = static_cast<char>(damaged[at] ^ 1 << engine() % 8);
    std::ofstream(path_, std::ios::binary) << damaged;
    const auto found = readableRowsOf(path_);
    if (!found || *found == *rows) continue;  // SQLite itself notices, or nobody need
    ++changed;
    const auto survey = surveyStore(path_, {}, SurveyDepth::kRows);
    if (!survey) continue;
    EXPECT_FALSE(survey->damage.empty()) << "bit of byte " << at;
    const auto glance = glanceAtStore(path_);
    EXPECT_TRUE(!glance || !glance->damage.empty()) << "bit of byte " << at;
    if (flip % 10 == 0) {
      EXPECT_THAT(saved(*survey).damage, IsEmpty()) << "bit of byte " << at;
    }
  }
  EXPECT_GT(changed, 500u);
}

// A bit of one number of a table, by the words that a reader gets of it; and the row is not saved.
TEST_F(StoreSurveyTest, OneFlippedBitOfANumber) {
  fill();
  const std::string whole = contentOf(path_);
  const auto flipped = [&](const std::string& bytes) {
    std::string damaged = whole;
    const size_t at = damaged.find(bytes);
    EXPECT_NE(at, std::string::npos);
    EXPECT_EQ(damaged.find(bytes, at + 1), std::string::npos) << "it is one place";
    damaged[at + 3] = static_cast<char>(damaged[at + 3] ^ 1);
    std::ofstream(path_, std::ios::binary) << damaged;
  };
  const auto little = [](double number) { return std::string(reinterpret_cast<const char*>(&number), sizeof number); };
  const auto big = [&](double number) {
    const std::string bytes = little(number);
    return std::string(bytes.rbegin(), bytes.rend());
  };
  const auto expectNamed = [&](const std::string& row) {
    const auto survey = surveyStore(path_);
    ASSERT_TRUE(survey) << survey.error().text;
    EXPECT_THAT(survey->damage, Contains(row + ": its checksum is not that of its values"));
    EXPECT_THAT(glanceAtStore(path_)->damage, Contains(row + ": its checksum is not that of its values"));
    EXPECT_THAT(saved(*survey).damage, IsEmpty());
  };
  const auto expectRefused = [&](const auto& read, const std::string& row) {
    ASSERT_FALSE(read);
    EXPECT_EQ(read.error().code, ErrorCode::kBadData);
    EXPECT_THAT(read.error().text, HasSubstr(row + " is damaged: its checksum"));
  };
  // Of what fill() puts into edges, verdicts, poses and merges.
  const Edge edge = read()->edges()->at(4);
  const MatchVerdict verdict = read()->verdicts()->at(3);
  const Pose pose = read()->keyframes()->at(6).T_map_cam;
  const MergeRecord merge = read()->merges()->at(0);
  flipped(little(edge.T_from_to.translation().x()) + little(edge.T_from_to.translation().y()));
  expectNamed("edge 5");
  expectRefused(read()->edges(), "edge 5");
  flipped(big(pose.translation().x()) + big(pose.translation().y()));
  expectNamed("pose of keyframe 6");
  expectRefused(read()->keyframes(), "pose of keyframe 6");
  flipped(big(merge.T_kept_absorbed.translation().x()) + big(merge.T_kept_absorbed.translation().y()));
  expectNamed("merge 1");
  expectRefused(read()->merges(), "merge 1");
  flipped(big(verdict.inlier_ratio) + big(verdict.rms_sigma));
  expectNamed("verdict 4");
  expectRefused(read()->verdicts(), "verdict 4");
}

// SQLite reads what is missing of the last page as zeros.
TEST_F(StoreSurveyTest, CutOffInsideAPage) {
  fill();
  const std::string whole = contentOf(path_);
  const std::vector<Edge> edges = *read()->edges();
  const std::vector<MatchVerdict> verdicts = *read()->verdicts();
  size_t saved_some = 0;
  std::vector<std::pair<std::string, int64_t>> pages;
  for (const std::string table : {"edges", "verdicts", "poses"}) {
    pages.emplace_back(table,
                       number("SELECT max(pageno) FROM dbstat WHERE pagetype = 'leaf' AND name = '" + table + "'"));
    ASSERT_GT(pages.back().second, 0) << table;
  }
  for (const auto& [table, page] : pages) {
    for (size_t into = 200; into < kPageBytes; into += 133) {
      std::ofstream(path_, std::ios::binary) << whole.substr(0, size_t(page - 1) * kPageBytes + into);
      const auto survey = surveyStore(path_, {}, SurveyDepth::kRows);
      if (!survey || survey->keyframes.empty()) continue;
      EXPECT_THAT(survey->damage, Contains(HasSubstr("the file is cut off")));
      EXPECT_THAT(saved(*survey).damage, IsEmpty());
      const auto store = MapStore::open(folder_ / "saved.comap", MapStore::Mode::kReadOnly);
      ASSERT_TRUE(store) << store.error().text;
      const auto kept = store->edges();
      ASSERT_TRUE(kept);
      for (const Edge& edge : *kept)
        EXPECT_TRUE(std::any_of(edges.begin(), edges.end(),
                                [&](const Edge& one) {
                                  const bool told_again =
                                      edge.T_from_to.translation() == poseOf(edge.to.sequence).translation();
                                  return one.from == edge.from && one.to == edge.to &&
                                         one.information == edge.information &&
                                         (told_again || one.T_from_to.translation() == edge.T_from_to.translation());
                                }))
            << table << " cut at " << into << ": an edge that was never there";
      const auto judged = store->verdicts();
      ASSERT_TRUE(judged);
      for (const MatchVerdict& verdict : *judged)
        EXPECT_TRUE(std::any_of(verdicts.begin(), verdicts.end(),
                                [&](const MatchVerdict& one) {
                                  return one.query == verdict.query && one.candidate == verdict.candidate &&
                                         one.inlier_ratio == verdict.inlier_ratio &&
                                         one.information == verdict.information;
                                }))
            << table << " cut at " << into << ": a verdict that was never there";
      ++saved_some;
    }
  }
  EXPECT_GT(saved_some, 10u);
}

TEST_F(StoreSurveyTest, CutOffAnywhere) {
  fill();
  const std::string whole = contentOf(path_);
  const std::vector<int64_t> needed = pagesNeeded();
  ASSERT_EQ(needed.size(), kKeyframes);
  const auto pages = static_cast<int64_t>(whole.size() / kPageBytes);
  size_t unreadable = 0, most = 0;
  for (int64_t left = 6; left < pages; left += 3) {
    const std::string cut = whole.substr(0, size_t(left) * kPageBytes);
    std::ofstream(path_, std::ios::binary) << cut;
    const auto expected =
        static_cast<size_t>(std::count_if(needed.begin(), needed.end(), [&](int64_t last) { return last <= left; }));
    const auto survey = surveyStore(path_);
    if (!survey) {
      ++unreadable;
      EXPECT_EQ(expected, 0u) << left << " pages: " << survey.error().text;
      continue;
    }
    EXPECT_THAT(survey->damage, Contains(HasSubstr("the file is cut off")));
    EXPECT_EQ(survey->keyframes.size(), expected) << left << " pages";
    const StoreSurvey again = saved(*survey);
    EXPECT_THAT(again.damage, IsEmpty()) << left << " pages";
    EXPECT_EQ(again.keyframes.size(), expected) << left << " pages";
    most = std::max(most, expected);
  }
  EXPECT_EQ(most, kKeyframes);
  EXPECT_LE(unreadable, 6u) << "only where pages of the schema are gone";
}

TEST_F(StoreSurveyTest, NumbersThatAreNoneAreNotSaved) {
  fill();
  sql("UPDATE poses SET qx = 9e999 WHERE keyframe = 3; UPDATE poses SET tx = NULL WHERE keyframe = 4;"
      "UPDATE edges SET numbers = zeroblob(55) WHERE number = 2");
  const auto survey = surveyStore(path_);
  ASSERT_TRUE(survey) << survey.error().text;
  EXPECT_THAT(survey->damage, Contains(HasSubstr("pose of keyframe 3")));
  EXPECT_THAT(survey->damage, Contains(HasSubstr("edge 2: ")));
  EXPECT_EQ(survey->keyframes.size(), kKeyframes);
  const StoreSurvey again = saved(*survey);
  EXPECT_THAT(again.damage, IsEmpty());
  const auto store = MapStore::open(folder_ / "saved.comap", MapStore::Mode::kReadOnly);
  ASSERT_TRUE(store);
  EXPECT_TRUE(store->keyframes()) << "what is saved can be read";
}

TEST_F(StoreSurveyTest, DamageAndGapsAreNamed) {
  fill();
  sql("UPDATE keyframe_messages SET encoded = zeroblob(length(encoded)) WHERE keyframe = 3;"
      "DELETE FROM keyframe_messages WHERE keyframe = 5;"
      "DELETE FROM keyframes WHERE arrival = 7;"
      "UPDATE edges SET numbers = zeroblob(4) WHERE number = 1;"
      "UPDATE tiles SET zstd = zeroblob(20) WHERE number = 2;");
  const auto survey = surveyStore(path_);
  ASSERT_TRUE(survey) << survey.error().text;
  const std::string session = "alpha/18364758544493064720/";
  for (const std::string& text : {"keyframe 3: " + session + "3, its message is damaged (checksum)",
                                  "keyframe " + session + "5: its message is not there",
                                  "keyframe " + session + "7: its row is lost, its message is whole",
                                  std::string("edge 1: a pose's quaternion has length"), std::string("tile 2: "),
                                  "names keyframe " + session + "5, which is not there or not whole"})
    EXPECT_THAT(survey->damage, Contains(HasSubstr(text)));
  EXPECT_EQ(survey->keyframes.size(), kKeyframes - 2);
  EXPECT_EQ(survey->tiles, 5u);
  ASSERT_FALSE(survey->edges.runs().empty());
  EXPECT_EQ(survey->edges.runs().front().first, 2) << "the first edge is damaged";
  EXPECT_THAT(survey->remarks, Contains(HasSubstr("sequences 3 to 3 are not there")));
  EXPECT_THAT(survey->remarks, Contains(HasSubstr("sequences 5 to 5 are not there")));
  const StoreSurvey again = saved(*survey);
  EXPECT_THAT(again.damage, IsEmpty());
  EXPECT_EQ(again.keyframes.size(), kKeyframes - 2);
}

TEST_F(StoreSurveyTest, WhatIsNoStoreIsRefused) {
  EXPECT_EQ(surveyStore(path_).error().code, ErrorCode::kUnreachable);
  std::ofstream(path_) << "no store";
  EXPECT_EQ(surveyStore(path_).error().code, ErrorCode::kBadData);
}

}  // namespace
}  // namespace comap
