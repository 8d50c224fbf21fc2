#include "protocol/codec/correction_codec.h"

#include <gmock/gmock.h>

#include <limits>

#include "tests/protocol/codec/samples.h"

namespace comap {
namespace {

using testing::HasSubstr;

TEST(CorrectionCodec, RoundTrip) {
  samples::Random random(1);
  for (int i = 0; i < 200; ++i) {
    const Correction correction{samples::robot(random), random(), samples::map(random), samples::pose(random),
                                random()};
    const auto bytes = encodeCorrection(correction);
    ASSERT_TRUE(bytes) << bytes.error().text;
    const auto back = decodeCorrection(*bytes);
    ASSERT_TRUE(back) << back.error().text;
    EXPECT_EQ(back->robot, correction.robot);
    EXPECT_EQ(back->session, correction.session);
    EXPECT_EQ(back->map, correction.map);
    EXPECT_EQ(back->revision, correction.revision);
    EXPECT_TRUE(samples::near(back->T_map_odom, correction.T_map_odom));
  }
}

TEST(CorrectionCodec, RefusesPosesThatAreNone) {
  const double kInf = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& t : {Eigen::Vector3d(kInf, 0, 0), Eigen::Vector3d(0, std::nan(""), 0),
                                   Eigen::Vector3d(0, 0, 2 * kMaxTranslation_m)}) {
    const auto bytes = encodeCorrection({"a", 1, "m", Pose(Eigen::Quaterniond::Identity(), t), 1});
    ASSERT_FALSE(bytes);
    EXPECT_THAT(bytes.error().text, HasSubstr("T_map_odom"));
  }
}

TEST(CorrectionCodec, RefusesBadMapNames) {
  for (const std::string& map : {std::string(), std::string(97, 'm'), std::string("a b"), std::string("a\n")}) {
    EXPECT_FALSE(encodeCorrection({"a", 1, map, Pose(), 1})) << map;
  }
}

TEST(CorrectionCodec, SurvivesHostileBytes) {
  samples::Random random(2);
  const auto bytes = encodeCorrection({"r1", 7, "r1-7-0", samples::pose(random), 3});
  ASSERT_TRUE(bytes);
  samples::abuse(random, *bytes, [](auto bad) {
    const auto correction = decodeCorrection(bad);
    if (!correction) return false;
    EXPECT_TRUE(correction->T_map_odom.isFinite());
    return true;
  });
}

}  // namespace
}  // namespace comap
