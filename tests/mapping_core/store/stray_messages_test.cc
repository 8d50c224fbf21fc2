// Messages that no page leads to any more: found by the leaves they lie on, held against what describes them.
#include "mapping_core/store/stray_messages.h"

#include <algorithm>
#include <fstream>

#include "tests/files/temporary_folder.h"
#include "tests/mapping_core/store/survey_fixture.h"

namespace comap {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

struct Overwritten {
  size_t page_bytes = 0;
  bool zeros = false;
};

void PrintTo(const Overwritten& how, std::ostream* out) {
  *out << (how.zeros ? "zeros" : "noise") << " over pages of " << how.page_bytes;
}

std::string nameOf(const testing::TestParamInfo<Overwritten>& info) {
  return (info.param.zeros ? "Zeros" : "Noise") + std::to_string(info.param.page_bytes);
}

class StrayMessagesTest : public StoreSurveyTest, public testing::WithParamInterface<Overwritten> {
 protected:
  void SetUp() override {
    StoreSurveyTest::SetUp();
    fill(GetParam().page_bytes);
    rows_ = rowsOf(path_);
    rows_.pop_back();  // how many tiles: they are computed
    root_ = number("SELECT rootpage FROM sqlite_schema WHERE name = 'keyframe_messages'");
    ASSERT_EQ(number("SELECT pagetype = 'internal' FROM dbstat WHERE pageno = " + std::to_string(root_)), 1);
  }
  void overwrite(int64_t page) {
    const size_t bytes = GetParam().page_bytes;
    std::string content = contentOf(path_);
    const std::vector<uint8_t> noise = GetParam().zeros ? std::vector<uint8_t>(bytes) : bytesOf(7, bytes);
    std::copy(noise.begin(), noise.end(), content.begin() + static_cast<std::ptrdiff_t>(size_t(page - 1) * bytes));
    std::ofstream(path_, std::ios::binary) << content;
  }
  // Of a table, the first leaf.
  int64_t leafOf(const std::string& table) {
    return number("SELECT min(pageno) FROM dbstat WHERE pagetype = 'leaf' AND name = '" + table + "'");
  }
  // Without what tells the next core that maps have to be computed.
  std::vector<std::string> savedRows() {
    std::vector<std::string> rows = rowsOf(folder_ / "saved.comap");
    rows.pop_back();
    std::erase_if(
        rows, [](const std::string& row) { return row.starts_with("complete ") || row.starts_with("votes_wait "); });
    return rows;
  }

  std::vector<std::string> rows_;  // of the whole store
  int64_t root_ = 0;
};
INSTANTIATE_TEST_SUITE_P(Pages, StrayMessagesTest,
                         testing::Values(Overwritten{kNewPageBytes, false}, Overwritten{kNewPageBytes, true},
                                         Overwritten{kSmallPageBytes, false}, Overwritten{kSmallPageBytes, true}),
                         nameOf);

TEST_P(StrayMessagesTest, TheRootOfTheirTable) {
  overwrite(root_);
  for (const SurveyDepth depth : {SurveyDepth::kPages, SurveyDepth::kRows}) {
    const auto survey = surveyStore(path_, {}, depth);
    ASSERT_TRUE(survey) << survey.error().text;
    EXPECT_THAT(survey->damage, Contains(HasSubstr("12 messages of keyframes to which no page leads any more: whole")));
    EXPECT_EQ(survey->keyframes.size(), kKeyframes);
    EXPECT_EQ(survey->lost_keyframes, 0u);
    const StoreSurvey again = saved(*survey);
    EXPECT_THAT(again.damage, IsEmpty());
    EXPECT_TRUE(savedRows() == rows_) << "to the last byte, in the order of their arrival";
  }
}

// What describes them is needed: without it, nothing says whose a blob is.
TEST_P(StrayMessagesTest, OnlyThoseThatAreDescribed) {
  const int64_t descriptions = number("SELECT rootpage FROM sqlite_schema WHERE name = 'keyframes'");
  overwrite(root_);
  overwrite(descriptions);
  const auto survey = surveyStore(path_, {}, SurveyDepth::kRows);
  ASSERT_TRUE(survey) << survey.error().text;
  EXPECT_THAT(survey->keyframes, IsEmpty());
  EXPECT_FALSE(survey->damage.empty());
}

// A leaf gone as well: those that lay on it, and no others.
TEST_P(StrayMessagesTest, WhatLayOnALeafThatIsGone) {
  const int64_t leaf = leafOf("keyframe_messages");
  const auto gone = static_cast<size_t>(number("SELECT ncell FROM dbstat WHERE pageno = " + std::to_string(leaf)));
  ASSERT_GT(gone, 0u);
  ASSERT_LT(gone, kKeyframes);
  overwrite(root_);
  overwrite(leaf);
  const auto survey = surveyStore(path_, {}, SurveyDepth::kRows);
  ASSERT_TRUE(survey) << survey.error().text;
  EXPECT_EQ(survey->keyframes.size(), kKeyframes - gone);
  EXPECT_EQ(survey->lost_keyframes, gone);
  const StoreSurvey again = saved(*survey);
  EXPECT_THAT(again.damage, IsEmpty());
  EXPECT_EQ(again.keyframes.size(), kKeyframes - gone);
  for (const std::string& row : savedRows())
    EXPECT_TRUE(std::count(rows_.begin(), rows_.end(), row) == 1) << "never there: " << row.substr(0, 100);
}

// Bytes of a message that are not what was written: it is not saved, its neighbours are.
TEST_P(StrayMessagesTest, OneThatIsDamaged) {
  const std::vector<uint8_t> message = messageOf(5);
  std::string content = contentOf(path_);
  const size_t at = content.find(std::string(message.end() - 2000, message.end() - 1960));
  ASSERT_NE(at, std::string::npos);
  content[at + 20] = static_cast<char>(content[at + 20] ^ 4);
  std::ofstream(path_, std::ios::binary) << content;
  overwrite(root_);
  const auto survey = surveyStore(path_, {}, SurveyDepth::kRows);
  ASSERT_TRUE(survey) << survey.error().text;
  EXPECT_EQ(survey->lost_keyframes, 1u);
  EXPECT_THAT(survey->damage, Contains("keyframe " + toString(idOf(5)) + ": its message is not there"));
  const StoreSurvey again = saved(*survey);
  EXPECT_THAT(again.damage, IsEmpty());
  EXPECT_EQ(again.keyframes.size(), kKeyframes - 1);
}

}  // namespace
}  // namespace comap
