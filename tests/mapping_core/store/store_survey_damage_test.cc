// Files that are damaged page by page, bit by bit, or cut off: what was changed is noticed, and no more than it is
// lost.
#include <algorithm>
#include <fstream>

#include "mapping_core/store/store_glance.h"
#include "tests/files/temporary_folder.h"
#include "tests/mapping_core/store/survey_fixture.h"

namespace comap {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

// Whether pages are as large as those of new stores or of earlier releases.
class StorePagesTest : public StoreSurveyTest, public testing::WithParamInterface<size_t> {
 protected:
  // What must be told of a file whose rows are not those that were written.
  void expectTold(const std::string& where) {
    const auto survey = surveyStore(path_, {}, SurveyDepth::kRows);
    EXPECT_TRUE(!survey || !survey->damage.empty()) << where;
    const auto glance = glanceAtStore(path_);
    EXPECT_TRUE(!glance || !glance->damage.empty()) << where;
  }
};
INSTANTIATE_TEST_SUITE_P(PageBytes, StorePagesTest, testing::Values(kNewPageBytes, kSmallPageBytes),
                         testing::PrintToStringParamName());

// Small pages: each message takes some, so that a page is of one keyframe.
TEST_F(StoreSurveyTest, EachPageInTurn) {
  constexpr size_t kPageBytes = kSmallPageBytes;
  fill(kPageBytes);
  std::string whole;
  {
    std::ifstream in(path_, std::ios::binary);
    whole.assign(std::istreambuf_iterator<char>(in), {});
  }
  const size_t pages = whole.size() / kPageBytes;
  ASSERT_GT(pages, 40u);
  size_t unreadable = 0, least = kKeyframes, looked = 0;
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
    least = std::min(least, again.keyframes.size());
    ++looked;
  }
  EXPECT_GT(copies_, 0u) << "some damage SQLite does not come upon";
  EXPECT_LT(copies_, 2 * looked);
  EXPECT_LE(unreadable, 4u) << "only the pages with the schema hide all";
  EXPECT_GE(least, kKeyframes - 2) << "a page hides those that begin on it";
}

// An index that can be read but says something else than its table: the rows are saved, the index is made anew.
TEST_P(StorePagesTest, BytesOfIndexes) {
  const size_t page_bytes = GetParam();
  fill(page_bytes);
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
    for (size_t at = page_bytes - 3; at > page_bytes - 120; at -= 7) {  // where its entries are
      std::string damaged = whole;
      char& byte = damaged[size_t(page - 1) * page_bytes + at];
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

// Whatever it is in, and however little it changes: a flipped bit that changes what a row says is noticed, by a glance,
// too, and what it is in is not saved as it is.
TEST_P(StorePagesTest, OneFlippedBit) {
  fill(GetParam());
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
    expectTold("bit of byte " + std::to_string(at));
    if (flip % 10 != 0) continue;
    if (const auto survey = surveyStore(path_, {}, SurveyDepth::kRows)) {
      EXPECT_THAT(saved(*survey).damage, IsEmpty()) << "bit of byte " << at;
    }
  }
  EXPECT_GT(changed, 250u) << "of larger pages, more is nobody's";
}

// What a page says of itself decides which rows anybody comes upon: one bit less in the number of its cells, or another
// page to the right, and some are gone, each of the others being whole.
TEST_P(StorePagesTest, OneFlippedBitOfAPagesHead) {
  constexpr size_t kCellsAt = 3, kCellsEnd = 5, kRightAt = 8, kRightEnd = 12, kFileHead = 100;
  fill(GetParam());
  const std::string whole = contentOf(path_);
  const auto rows = readableRowsOf(path_);
  size_t changed = 0;
  const auto pages = static_cast<int64_t>(whole.size() / GetParam());
  for (int64_t page = 1; page <= pages; ++page) {
    std::ofstream(path_, std::ios::binary) << whole;
    const std::string one = " FROM dbstat WHERE pagetype <> 'overflow' AND pageno = " + std::to_string(page);
    if (number("SELECT count(*)" + one) == 0) continue;
    const bool leads_on = number("SELECT pagetype = 'internal'" + one) == 1;
    const size_t head = size_t(page - 1) * GetParam() + (page == 1 ? kFileHead : 0);
    for (size_t in = kCellsAt; in < (leads_on ? kRightEnd : kCellsEnd); ++in) {
      if (in >= kCellsEnd && in < kRightAt) continue;  // where there is room: no reader asks
      for (int bit = 0; bit < 8; ++bit) {
        std::string damaged = whole;
        damaged[head + in] = static_cast<char>(damaged[head + in] ^ 1 << bit);
        std::ofstream(path_, std::ios::binary) << damaged;
        const auto found = readableRowsOf(path_);
        if (!found || *found == *rows) continue;
        ++changed;
        expectTold("page " + std::to_string(page) + ", byte " + std::to_string(in) + ", bit " + std::to_string(bit));
      }
    }
  }
  EXPECT_GT(changed, 50u);
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
  constexpr size_t kPageBytes = kSmallPageBytes;
  fill(kPageBytes);
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

// Small pages: each message goes on over some of them.
TEST_F(StoreSurveyTest, CutOffAnywhere) {
  constexpr size_t kPageBytes = kSmallPageBytes;
  fill(kPageBytes);
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

}  // namespace
}  // namespace comap
