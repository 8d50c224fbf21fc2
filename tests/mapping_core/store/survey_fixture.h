// A small store of which all is known, and what can be asked of one that is damaged.
#pragma once

#include <gmock/gmock.h>
#include <sqlite3.h>

#include <optional>

#include "mapping_core/store/store_survey.h"
#include "protocol/codec/keyframe_codec.h"
#include "tests/mapping_core/store/store_fixture.h"

namespace comap {

inline constexpr uint32_t kKeyframes = 12;

class StoreSurveyTest : public StoreTest {
 protected:
  // Noise, so that a message takes some pages.
  static std::vector<uint8_t> messageOf(uint32_t sequence, const Pose& T_odom_cam = Pose()) {
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
    keyframe.T_odom_cam = T_odom_cam;
    const auto encoded = encodeKeyframe(keyframe);
    EXPECT_TRUE(encoded) << (encoded ? "" : encoded.error().text);
    return encoded ? *encoded : std::vector<uint8_t>();
  }
  void fill(size_t page_bytes = kNewPageBytes) {
    if (page_bytes == kSmallPageBytes) makeSmallPages(path_);
    auto store = create();
    ASSERT_TRUE(store);
    ASSERT_EQ(number("PRAGMA page_size"), static_cast<int64_t>(page_bytes));
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
  // All of a store, in words. Nothing if SQLite cannot read it all. Without the declarations of two indexes that are
  // there for speed: the next program that opens the store to write makes those it lacks.
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
    for (const char* sql : {"SELECT name, sql FROM sqlite_schema WHERE name NOT IN ('edges_of_merges', "
                            "'edges_withdrawn_by_kind') ORDER BY name",
                            "SELECT * FROM meta", "SELECT * FROM robots", "SELECT * FROM keyframes",
                            "SELECT keyframe, hex(encoded) FROM keyframe_messages", "SELECT * FROM poses",
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
    EXPECT_THAT(surveyStore(second)->damage, testing::IsEmpty());
    auto again = surveyStore(path);
    EXPECT_TRUE(again) << (again ? "" : again.error().text);
    return again ? *again : StoreSurvey();
  }
  size_t copies_ = 0;  // that could be made
};

}  // namespace comap
