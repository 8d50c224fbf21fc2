#include "mapping_core/ferns/place_index.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "mapping_core/ferns/fern_encoder.h"
#include "tests/scenes/scene.h"

namespace comap {
namespace {

const auto kAll = [](uint32_t) { return true; };

// Keyframes of a walk that turns once around the room.
constexpr int kPlaces = 14;
Pose keyframePose(int i) {
  const double angle = 2 * M_PI * i / kPlaces;
  return Pose(Eigen::Quaterniond(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitY())),
              {0.5 * std::cos(angle), 0, 0.5 * std::sin(angle)});
}

FernCode codeAt(const Pose& pose) {
  static const Scene kRoom = Scene::room();
  const Frame frame = kRoom.render(smallCamera(), pose);
  return encodeFerns(FernBook::standard(), frame.colour, frame.depth);
}

class PlacesOfAWalk : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    for (uint32_t i = 0; i < kPlaces; ++i) EXPECT_TRUE(index().add(100 + i, codeAt(keyframePose(static_cast<int>(i)))));
  }
  static PlaceIndex& index() {
    static PlaceIndex places;
    return places;
  }
};

TEST_F(PlacesOfAWalk, anAddedFrameIsFoundExactly) {
  EXPECT_EQ(index().size(), static_cast<size_t>(kPlaces));
  for (uint32_t i = 0; i < kPlaces; ++i) {
    const auto found = index().query(codeAt(keyframePose(static_cast<int>(i))), 3, kAll);
    ASSERT_EQ(found.size(), 3u);
    EXPECT_EQ(found[0].place, 100 + i);
    EXPECT_EQ(found[0].dissimilarity, 0);
    EXPECT_LE(found[1].dissimilarity, found[2].dissimilarity);
  }
}

TEST_F(PlacesOfAWalk, neighboursRankFirst) {
  const Eigen::Vector3d moves[] = {{0.05, 0, 0}, {-0.05, 0, 0}, {0, 0, 0.05}, {0, 0, -0.05}, {0, 0.05, 0}};
  for (int i = 0; i < kPlaces; ++i)
    for (int m = 0; m < 5; ++m) {
      const double turn = (m % 2 == 0 ? 5 : -5) * M_PI / 180;
      const Eigen::Vector3d axis = m == 4 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
      const Pose near = keyframePose(i) * Pose(Eigen::Quaterniond(Eigen::AngleAxisd(turn, axis)), moves[m]);
      const auto found = index().query(codeAt(near), 1, kAll);
      ASSERT_EQ(found.size(), 1u);
      EXPECT_EQ(found[0].place, 100u + static_cast<uint32_t>(i)) << "place " << i << " move " << m;
      EXPECT_GT(found[0].dissimilarity, 0);
    }
}

TEST_F(PlacesOfAWalk, onlyAdmittedPlacesComeBack) {
  const FernCode code = codeAt(keyframePose(4));
  const auto found = index().query(code, kPlaces, [](uint32_t place) { return place % 2 == 1; });
  EXPECT_EQ(found.size(), static_cast<size_t>(kPlaces) / 2);
  for (const PlaceCandidate& candidate : found) EXPECT_EQ(candidate.place % 2, 1u);
  EXPECT_TRUE(index().query(code, 5, [](uint32_t) { return false; }).empty());
}

TEST_F(PlacesOfAWalk, theListAgreesWithTheDirectComparison) {
  const FernCode code = codeAt(keyframePose(2) * Pose(Eigen::Quaterniond::Identity(), {0.1, 0, 0.1}));
  for (const PlaceCandidate& candidate : index().query(code, kPlaces, kAll))
    EXPECT_DOUBLE_EQ(candidate.dissimilarity,
                     dissimilarity(code, codeAt(keyframePose(static_cast<int>(candidate.place) - 100))));
}

FernCode codeOf(std::vector<uint8_t> codes, uint64_t book = 1) { return {book, std::move(codes)}; }

TEST(PlaceIndex, anotherBookIsRefused) {
  PlaceIndex index;
  EXPECT_TRUE(index.add(1, codeOf({1, 2, 3}, 1)));
  EXPECT_FALSE(index.add(2, codeOf({1, 2, 3}, 2)));
  EXPECT_FALSE(index.add(3, codeOf({1, 2}, 1))) << "another size";
  EXPECT_EQ(index.size(), 1u);
  EXPECT_TRUE(index.query(codeOf({1, 2, 3}, 2), 5, kAll).empty());
  EXPECT_TRUE(index.query(codeOf({1, 2}, 1), 5, kAll).empty());
  EXPECT_EQ(dissimilarity(codeOf({1, 2, 3}, 1), codeOf({1, 2, 3}, 2)), 1);
}

TEST(PlaceIndex, tiesGoToTheLowerNumberWhateverTheOrder) {
  for (const std::vector<uint32_t>& order : {std::vector<uint32_t>{5, 3, 9}, {9, 5, 3}, {3, 9, 5}}) {
    PlaceIndex index;
    for (const uint32_t place : order) EXPECT_TRUE(index.add(place, codeOf({1, 2, 3, 4})));
    const auto found = index.query(codeOf({1, 2, 3, 5}), 2, kAll);
    ASSERT_EQ(found.size(), 2u);
    EXPECT_EQ(found[0].place, 3u);
    EXPECT_EQ(found[1].place, 5u);
    EXPECT_DOUBLE_EQ(found[0].dissimilarity, 0.25);
  }
}

TEST(PlaceIndex, badFernsDoNotCount) {
  constexpr uint8_t kBad = FernCode::kBad;
  EXPECT_DOUBLE_EQ(dissimilarity(codeOf({1, kBad, 3, 4}), codeOf({1, 2, 5, kBad})), 0.5);
  EXPECT_DOUBLE_EQ(dissimilarity(codeOf({kBad, kBad}), codeOf({kBad, kBad})), 1) << "nothing in common is no match";
  std::vector<uint8_t> few(20, kBad);
  few[0] = 7;
  EXPECT_DOUBLE_EQ(dissimilarity(codeOf(few), codeOf(few)), 1) << "a twentieth is too little to say anything";
}

TEST(PlaceIndex, theSameAsComparingWithEachOne) {
  std::mt19937 engine(3);
  const auto draw = [&](size_t ferns, uint32_t kinds) {
    std::vector<uint8_t> codes(ferns);
    for (uint8_t& code : codes) code = engine() % 6 == 0 ? FernCode::kBad : static_cast<uint8_t>(engine() % kinds);
    return codeOf(codes);
  };
  for (const size_t ferns : {1u, 63u, 64u, 65u, 500u})
    for (const uint32_t kinds : {2u, 16u}) {
      PlaceIndex index;
      std::vector<FernCode> codes;
      for (uint32_t place = 0; place < 200; ++place) {
        codes.push_back(draw(ferns, kinds));
        ASSERT_TRUE(index.add(place, codes.back()));
      }
      for (int round = 0; round < 10; ++round) {
        const FernCode query = draw(ferns, kinds);
        std::vector<std::pair<double, uint32_t>> expected;
        for (uint32_t place = 0; place < 200; ++place) {
          size_t equal = 0;
          for (size_t i = 0; i < ferns; ++i)
            equal += query.codes[i] != FernCode::kBad && query.codes[i] == codes[place].codes[i];
          if (equal > 0 && place % 3 != 0) expected.emplace_back(dissimilarity(query, codes[place]), place);
        }
        std::sort(expected.begin(), expected.end());
        const auto found = index.query(query, 12, [](uint32_t place) { return place % 3 != 0; });
        ASSERT_EQ(found.size(), std::min<size_t>(12, expected.size()));
        for (size_t i = 0; i < found.size(); ++i) {
          EXPECT_EQ(found[i].place, expected[i].second);
          EXPECT_EQ(found[i].dissimilarity, expected[i].first);
        }
      }
    }
}

TEST(PlaceIndex, anEmptyIndexKnowsNothing) {
  const PlaceIndex index;
  EXPECT_TRUE(index.query(codeOf({1, 2, 3}), 5, kAll).empty());
}

}  // namespace
}  // namespace comap
