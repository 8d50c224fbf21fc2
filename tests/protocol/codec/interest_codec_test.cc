#include "protocol/codec/interest_codec.h"

#include <gmock/gmock.h>

#include "tests/protocol/codec/samples.h"

namespace comap {
namespace {

using testing::HasSubstr;

Interest sample(samples::Random& random, int tiles) {
  Interest interest{samples::robot(random),          random(), samples::pose(random), samples::real(random, 0, 50),
                    static_cast<uint32_t>(random()), {}};
  const std::string maps[2] = {samples::map(random), samples::map(random)};
  for (int i = 0; i < tiles; ++i) {
    const auto coordinate = [&] { return static_cast<int32_t>(samples::uniform(random, -40, 40)); };
    const std::string& map = maps[samples::uniform(random, 0, 9) == 0 ? 1 : 0];
    interest.held.push_back(
        {{map, coordinate(), coordinate(), coordinate()}, static_cast<uint64_t>(samples::uniform(random, 0, 3000))});
  }
  if (tiles % 2 == 1) interest.at = MapPose{maps[0], samples::pose(random)};
  return interest;
}

TEST(InterestCodec, RoundTripKeepsTheOrder) {
  samples::Random random(1);
  for (int i = 0; i < 100; ++i) {
    const Interest interest = sample(random, i);
    const auto bytes = encodeInterest(interest);
    ASSERT_TRUE(bytes) << bytes.error().text;
    const auto back = decodeInterest(*bytes);
    ASSERT_TRUE(back) << back.error().text;
    EXPECT_EQ(back->robot, interest.robot);
    EXPECT_EQ(back->session, interest.session);
    EXPECT_TRUE(samples::near(back->T_odom_cam, interest.T_odom_cam));
    EXPECT_EQ(back->radius_m, interest.radius_m);
    EXPECT_EQ(back->budget_bytes_per_s, interest.budget_bytes_per_s);
    ASSERT_EQ(back->at.has_value(), interest.at.has_value());
    if (interest.at) {
      EXPECT_EQ(back->at->map, interest.at->map);
      EXPECT_TRUE(samples::near(back->at->T_map_cam, interest.at->T_map_cam));
    }
    ASSERT_EQ(back->held.size(), interest.held.size());
    for (size_t k = 0; k < interest.held.size(); ++k) {
      EXPECT_EQ(back->held[k].key, interest.held[k].key);
      EXPECT_EQ(back->held[k].revision, interest.held[k].revision);
    }
  }
}

TEST(InterestCodec, ATileHeldTakesAFewBytes) {
  samples::Random random(3);
  Interest interest = sample(random, 1000);
  for (HeldTile& tile : interest.held) tile.key.map = "r1-1-0";
  const auto bytes = encodeInterest(interest);
  ASSERT_TRUE(bytes);
  EXPECT_LT(bytes->size(), 5500u);
}

TEST(InterestCodec, RefusesMoreTilesThanTheLimit) {
  samples::Random random(4);
  Interest interest = sample(random, 0);
  interest.held.resize(kMaxHeldTiles + 1, {{"m", 0, 0, 0}, 0});
  const auto bytes = encodeInterest(interest);
  ASSERT_FALSE(bytes);
  EXPECT_THAT(bytes.error().text, HasSubstr("interest: held has 32769 entries"));
}

TEST(InterestCodec, RefusesARadiusThatIsNone) {
  samples::Random random(5);
  Interest interest = sample(random, 1);
  for (const double radius : {-1.0, std::nan(""), 1e9}) {
    interest.radius_m = radius;
    EXPECT_FALSE(encodeInterest(interest)) << radius;
  }
}

TEST(InterestCodec, RefusesAPlaceThatIsNone) {
  samples::Random random(6);
  Interest interest = sample(random, 1);
  interest.at->map = "no map";
  EXPECT_THAT(encodeInterest(interest).error().text, HasSubstr("at.map"));
  interest.at = MapPose{"m", Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 2e6, 0))};
  EXPECT_THAT(encodeInterest(interest).error().text, HasSubstr("at.T_map_cam"));
}

TEST(InterestCodec, SurvivesHostileBytes) {
  samples::Random random(2);
  for (const int tiles : {0, 1, 20}) {
    const auto bytes = encodeInterest(sample(random, tiles));
    ASSERT_TRUE(bytes);
    samples::abuse(random, *bytes, [](auto bad) { return static_cast<bool>(decodeInterest(bad)); });
  }
}

}  // namespace
}  // namespace comap
