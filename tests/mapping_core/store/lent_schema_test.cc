// Stores whose first page is damaged: all else is found with that of a new store in its place.
#include "mapping_core/store/lent_schema.h"

#include <algorithm>
#include <fstream>

#include "mapping_core/store/schema.h"
#include "protocol/storage/database.h"
#include "tests/files/temporary_folder.h"
#include "tests/mapping_core/store/survey_fixture.h"

namespace comap {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;

class LentSchemaTest : public StoreSurveyTest {
 protected:
  void overwrite(size_t at, const std::vector<uint8_t>& bytes) {
    std::string content = contentOf(path_);
    ASSERT_LE(at + bytes.size(), content.size());
    std::copy(bytes.begin(), bytes.end(), content.begin() + static_cast<std::ptrdiff_t>(at));
    std::ofstream(path_, std::ios::binary) << content;
  }
  // Of a copy that can be written over.
  std::optional<StoreSurvey> lent() {
    std::filesystem::copy_file(path_, copy_, std::filesystem::copy_options::overwrite_existing);
    return surveyWithLentSchema(copy_);
  }
  // All but what the next core computes, and what tells it to.
  static std::vector<std::string> kept(const std::string& path) {
    std::vector<std::string> rows = rowsOf(path);
    rows.pop_back();
    std::erase_if(rows, [](const std::string& row) {
      return row.starts_with("complete ") || row.starts_with("votes_wait ") || row.starts_with("compact_due ");
    });
    return rows;
  }
  void SetUp() override {
    StoreSurveyTest::SetUp();
    copy_ = folder_ / "copy.comap";
  }
  std::string copy_;
};

class LentLayoutTest : public LentSchemaTest, public testing::WithParamInterface<std::tuple<size_t, bool>> {
 protected:
  void SetUp() override {
    LentSchemaTest::SetUp();
    fill(std::get<0>(GetParam()));
    if (std::get<1>(GetParam())) {
      ASSERT_TRUE(create()->compact());
    }
  }
};
INSTANTIATE_TEST_SUITE_P(PagesAndWrittenAnew, LentLayoutTest,
                         testing::Combine(testing::Values(kNewPageBytes, kSmallPageBytes), testing::Bool()));

TEST_P(LentLayoutTest, AllElseIsSaved) {
  const std::vector<std::string> rows = kept(path_);
  for (const bool zeros : {false, true}) {
    overwrite(0, zeros ? std::vector<uint8_t>(std::get<0>(GetParam())) : bytesOf(3, std::get<0>(GetParam())));
    EXPECT_FALSE(surveyStore(path_)) << "without another page nothing can be told";
    const auto survey = lent();
    ASSERT_TRUE(survey);
    EXPECT_THAT(survey->damage, testing::ElementsAre(HasSubstr("first page")));
    EXPECT_EQ(survey->keyframes.size(), kKeyframes);
    EXPECT_EQ(survey->lost_keyframes, 0u);
    EXPECT_THAT(saved(*survey).damage, IsEmpty());
    const std::vector<std::string> found = kept(folder_ / "saved.comap");
    for (const std::string& row : found)
      EXPECT_TRUE(std::count(rows.begin(), rows.end(), row) == 1) << "never there: " << row.substr(0, 80);
    for (const std::string& row : rows)
      EXPECT_TRUE(std::count(found.begin(), found.end(), row) == 1) << "not saved: " << row.substr(0, 80);
  }
}

// A bit of the head that makes SQLite refuse the file, or read it otherwise.
TEST_F(LentSchemaTest, AFlippedBitOfTheHead) {
  constexpr size_t kHead = 100, kVersionAt = 60, kVersionEnd = 64;
  fill();
  const std::string whole = contentOf(path_);
  size_t lost = 0;
  for (size_t at = 0; at < kHead; ++at) {
    if (at >= kVersionAt && at < kVersionEnd) continue;  // then it is of a release that nobody knows
    for (const int bit : {0, 5, 7}) {
      std::string damaged = whole;
      damaged[at] = static_cast<char>(damaged[at] ^ 1 << bit);
      std::ofstream(path_, std::ios::binary) << damaged;
      const auto survey = surveyStore(path_, {}, SurveyDepth::kRows);
      if (survey && survey->keyframes.size() == kKeyframes) continue;
      ++lost;
      const auto found = lent();
      ASSERT_TRUE(found) << "byte " << at << ", bit " << bit;
      EXPECT_EQ(found->keyframes.size(), kKeyframes) << "byte " << at << ", bit " << bit;
    }
  }
  EXPECT_GT(lost, 20u);
}

TEST_F(LentSchemaTest, WhatIsNoStoreOrANewerOneIsNone) {
  EXPECT_FALSE(surveyWithLentSchema(path_)) << "no file";
  std::ofstream(path_, std::ios::binary) << std::string(100000, 'x');
  EXPECT_FALSE(lent());
  std::filesystem::remove(path_);
  fill();
  sql("PRAGMA user_version = 5");
  EXPECT_FALSE(lent()) << "of a newer release, which may mean something else by it";
  sql("PRAGMA user_version = 4");
  EXPECT_TRUE(lent());
  for (const auto& file : std::filesystem::directory_iterator(folder_))
    EXPECT_THAT(file.path().string(), testing::Not(HasSubstr("lent"))) << "a store that was made for its page is left";
}

}  // namespace
}  // namespace comap
