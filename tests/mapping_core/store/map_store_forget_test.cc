// Taking a robot out of a store: what its file still holds of it, and what merges say of when they were made.
#include <algorithm>
#include <fstream>

#include "mapping_core/store/store_glance.h"
#include "mapping_core/store/store_survey.h"
#include "tests/mapping_core/store/store_fixture.h"

namespace comap {
namespace {

constexpr size_t kPictureBytes = 30000;

class MapStoreForgetTest : public StoreTest {
 protected:
  // Three robots by turns; merge 1 of alpha and carol, merge 2 of alpha and bravo; both were given again.
  void fill() {
    auto store = create();
    ASSERT_TRUE(store);
    for (uint32_t i = 0; i < 5; ++i) {
      for (const std::string robot : {"alpha", "bravo", "carol"}) {
        ASSERT_TRUE(*store->addKeyframe(idOf(i, robot), i, pictureOf(robot, i)));
        ASSERT_TRUE(store->setPoses("m", {{idOf(i, robot), poseOf(i)}}));
      }
    }
    ASSERT_TRUE(store->setTiles(std::vector<Tile>{tileOf("m", 0, 0, 0, 20, 1)}));
    ASSERT_TRUE(store->addMerge({1, "a", "c", poseOf(1), {"alpha", "carol"}, {idOf(2, "carol")}, 9, {}}));
    ASSERT_TRUE(store->addMerge({2, "a", "b", poseOf(2), {"alpha", "bravo"}, {idOf(3, "bravo")}, 12, {}}));
    ASSERT_TRUE(store->setGivenAgain(1, 14));
    ASSERT_TRUE(store->setGivenAgain(2, 15));
  }
  static std::vector<uint8_t> pictureOf(const std::string& robot, uint32_t sequence) {
    return bytesOf(sequence * 3 + robot[0], kPictureBytes);
  }
  // How many of bravo's pictures can be found in the store's files: by a part that one page of SQLite's holds.
  size_t picturesInFile() const {
    std::string bytes;
    for (const char* part : {"", "-wal"}) {
      std::ifstream file(path_.string() + part, std::ios::binary);
      bytes.append(std::istreambuf_iterator<char>(file), {});
    }
    size_t found = 0;
    for (uint32_t i = 0; i < 5; ++i) {
      const std::vector<uint8_t> picture = pictureOf("bravo", i);
      bool there = false;
      for (size_t at = 10000; at < 14000; at += 500)
        there |= std::search(bytes.begin(), bytes.end(), picture.begin() + std::ptrdiff_t(at),
                             picture.begin() + std::ptrdiff_t(at) + 100,
                             [](char a, uint8_t b) { return static_cast<uint8_t>(a) == b; }) != bytes.end();
      found += there;
    }
    return found;
  }
};

TEST_F(MapStoreForgetTest, WhatIsForgottenIsNamedUntilTheFileIsWrittenAnew) {
  fill();
  EXPECT_EQ(picturesInFile(), 5u);
  EXPECT_FALSE(*read()->compactDue());
  {
    auto store = create();
    EXPECT_EQ(*store->removeRobot("bravo"), 5u);
    EXPECT_TRUE(store->tiles("")->empty()) << "they hold its surfels";
  }
  // As after a program that was killed between the decision and the writing anew.
  EXPECT_EQ(picturesInFile(), 0u) << "overwritten";
  const auto size = std::filesystem::file_size(path_);
  EXPECT_TRUE(*read()->compactDue());
  ASSERT_EQ(glanceAtStore(path_)->remarks.size(), 1u);
  EXPECT_NE(surveyStore(path_)->remarks.at(0).find("writes the file anew"), std::string::npos);
  ASSERT_TRUE(create()->compact());
  EXPECT_LT(std::filesystem::file_size(path_) + 5 * kPictureBytes, size);
  EXPECT_FALSE(*read()->compactDue());
  EXPECT_TRUE(glanceAtStore(path_)->remarks.empty());
  EXPECT_EQ(*read()->encodedKeyframe(idOf(4, "carol")), pictureOf("carol", 4));
}

TEST_F(MapStoreForgetTest, AReaderThatHoldsTheOldPagesKeepsItDue) {
  fill();
  auto store = create();
  EXPECT_EQ(*store->removeRobot("bravo"), 5u);
  auto reader = read();
  {
    const auto moment = reader->beginReading();
    ASSERT_TRUE(moment);
    ASSERT_EQ(reader->keyframes()->size(), 10u);
    EXPECT_FALSE(store->compact());
    EXPECT_TRUE(*store->compactDue());
  }
  EXPECT_TRUE(store->compact());
  EXPECT_FALSE(*store->compactDue());
}

TEST_F(MapStoreForgetTest, MergesAreCountedWithoutTheRobotAndNothingStaysOfOnesThatWent) {
  fill();
  auto store = create();
  EXPECT_EQ(*store->removeRobot("bravo"), 5u);
  const auto merges = *store->merges();
  ASSERT_EQ(merges.size(), 1u);
  EXPECT_EQ(merges[0].keyframes_ingested, 6u) << "of nine, three were bravo's";
  EXPECT_EQ(*store->givenAgain(1), std::optional<size_t>(9));
  EXPECT_EQ(*store->givenAgain(2), std::nullopt) << "the next merge may get its number";
}

TEST_F(MapStoreForgetTest, WhatIsReadAtOneMomentIsOfThatMoment) {
  fill();
  auto reader = read();
  auto store = create();
  {
    const auto moment = reader->beginReading();
    ASSERT_TRUE(moment);
    ASSERT_EQ(reader->keyframes()->size(), 15u);
    ASSERT_TRUE(*store->addKeyframe(idOf(5), 5, pictureOf("alpha", 5)));
    EXPECT_EQ(reader->keyframes()->size(), 15u);
  }
  EXPECT_EQ(reader->keyframes()->size(), 16u);
}

}  // namespace
}  // namespace comap
