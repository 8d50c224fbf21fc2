#include "edge_agent/odometry/place_memory.h"

#include <gtest/gtest.h>

#include <set>

namespace comap {
namespace {

constexpr size_t kFerns = 100;

// A code whose first `changed` ferns differ from those of group `group`: dissimilarity within a group is counted out.
FernCode code(uint8_t group, size_t changed) {
  FernCode c{77, std::vector<uint8_t>(kFerns, group)};
  for (size_t i = 0; i < changed; ++i) c.codes[i] = 15;
  return c;
}

Pyramid picture(float depth_m = 2) {
  Pyramid pyramid(kPlaceLevel + 2);
  const CameraModel camera{131, 131, 79.5, 59.5, 160, 120};
  PyramidLevel& level = pyramid[kPlaceLevel];
  level = {camera, Image<float>(160, 120), Image<float>(160, 120, depth_m)};
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 160; ++x) level.grey.at(x, y) = static_cast<float>((3 * x + 5 * y) % 256) + 0.3f;
  return pyramid;
}

std::set<uint32_t> sequences(const PlaceMemory& memory) {
  std::set<uint32_t> found;
  for (uint32_t i = 0; i < memory.size(); ++i) found.insert(memory.at(i).sequence);
  return found;
}

TEST(PlaceMemory, givesBackThePictureAndTheNextCoarserLevel) {
  PlaceMemory memory(3);
  Pyramid in = picture(1.2345f);
  in[kPlaceLevel].depth_m.at(7, 9) = 0;
  const Pose T(Eigen::Quaterniond::Identity(), {1, 2, 3});
  ASSERT_TRUE(memory.add(5, T, code(1, 0), in));
  const RememberedPlace& place = memory.at(0);
  EXPECT_EQ(place.sequence, 5u);
  EXPECT_EQ(place.T_odom_keyframe.translation(), T.translation());
  EXPECT_EQ(place.grey.size() * (sizeof(uint8_t) + sizeof(uint16_t)), 57600u);
  const Pyramid out = place.pyramid();
  ASSERT_EQ(out.size(), static_cast<size_t>(kPlaceLevel + 2));
  EXPECT_EQ(out[kPlaceLevel].camera, in[kPlaceLevel].camera);
  EXPECT_EQ(out[kPlaceLevel + 1].camera, in[kPlaceLevel].camera.shrunk(2));
  EXPECT_EQ(out[kPlaceLevel + 1].grey.width(), 80);
  EXPECT_EQ(out[kPlaceLevel].depth_m.at(7, 9), 0);
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 160; ++x) {
      ASSERT_NEAR(out[kPlaceLevel].grey.at(x, y), in[kPlaceLevel].grey.at(x, y), 0.51);
      ASSERT_NEAR(out[kPlaceLevel].depth_m.at(x, y), in[kPlaceLevel].depth_m.at(x, y), 0.00011);
    }
}

TEST(PlaceMemory, theMostSimilarComesFirstAndTheFarNotAtAll) {
  PlaceMemory memory(10);
  ASSERT_TRUE(memory.add(0, Pose(), code(1, 30), picture()));
  ASSERT_TRUE(memory.add(1, Pose(), code(1, 10), picture()));
  ASSERT_TRUE(memory.add(2, Pose(), code(2, 0), picture()));
  ASSERT_TRUE(memory.add(3, Pose(), code(1, 20), picture()));
  const auto similar = memory.similar(code(1, 0), 5, 0.25);
  ASSERT_EQ(similar.size(), 2u);
  EXPECT_EQ(memory.at(similar[0].place).sequence, 1u);
  EXPECT_DOUBLE_EQ(similar[0].dissimilarity, 0.10);
  EXPECT_EQ(memory.at(similar[1].place).sequence, 3u);
  EXPECT_EQ(memory.similar(code(1, 0), 1, 1).size(), 1u);
  EXPECT_TRUE(memory.similar(FernCode{78, code(1, 0).codes}, 5, 1).empty()) << "another book";
}

TEST(PlaceMemory, whenFullTheNewerOfTheMostSimilarIsForgotten) {
  PlaceMemory memory(4);
  ASSERT_TRUE(memory.add(0, Pose(), code(1, 0), picture()));
  ASSERT_TRUE(memory.add(1, Pose(), code(2, 0), picture()));
  ASSERT_TRUE(memory.add(2, Pose(), code(1, 5), picture()));
  ASSERT_TRUE(memory.add(3, Pose(), code(3, 0), picture()));
  EXPECT_TRUE(memory.add(4, Pose(), code(4, 0), picture()));
  EXPECT_EQ(sequences(memory), (std::set<uint32_t>{0, 1, 3, 4})) << "2 was like 0";
  EXPECT_FALSE(memory.add(5, Pose(), code(3, 9), picture())) << "it is the newer of the closest pair itself";
  EXPECT_EQ(sequences(memory), (std::set<uint32_t>{0, 1, 3, 4}));
}

// A robot that pans slowly: each view is like the one before. The memory must go on covering the whole way.
TEST(PlaceMemory, aSlowPassIsThinnedOutEvenly) {
  PlaceMemory memory(11);
  for (uint32_t i = 0; i <= 100; ++i) memory.add(i, Pose(), code(1, i), picture());
  EXPECT_EQ(memory.size(), 11u);
  for (size_t i = 0; i <= 100; ++i) {
    const auto nearest = memory.similar(code(1, i), 1, 1);
    ASSERT_EQ(nearest.size(), 1u);
    EXPECT_LE(nearest[0].dissimilarity, 0.161) << "view " << i;
  }
}

TEST(PlaceMemory, refusesWhatCannotBeRecognised) {
  PlaceMemory memory(4);
  ASSERT_TRUE(memory.add(0, Pose(), code(1, 0), picture()));
  FernCode blind = code(2, 0);
  std::fill(blind.codes.begin() + 9, blind.codes.end(), FernCode::kBad);
  EXPECT_FALSE(memory.add(1, Pose(), blind, picture()));
  EXPECT_FALSE(memory.add(1, Pose(), code(2, 0), picture(0))) << "no depth";
  EXPECT_FALSE(memory.add(1, Pose(), code(2, 0), Pyramid(kPlaceLevel + 1))) << "too few levels";
  EXPECT_FALSE(memory.add(1, Pose(), code(2, 0), Pyramid(kPlaceLevel + 2))) << "empty levels";
  EXPECT_FALSE(memory.add(1, Pose(), FernCode{78, code(2, 0).codes}, picture())) << "another book";
  EXPECT_FALSE(memory.add(1, Pose(), FernCode{77, {}}, picture())) << "no code";
  EXPECT_FALSE(memory.add(0, Pose(), code(2, 0), picture())) << "there already";
  EXPECT_EQ(memory.size(), 1u);
  memory.clear();
  EXPECT_EQ(memory.size(), 0u);
  EXPECT_TRUE(memory.add(0, Pose(), FernCode{78, code(2, 0).codes}, picture()));
}

}  // namespace
}  // namespace comap
