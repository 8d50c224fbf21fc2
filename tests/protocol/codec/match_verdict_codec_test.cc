#include "protocol/codec/match_verdict_codec.h"

#include <gmock/gmock.h>

#include <limits>

#include "tests/protocol/codec/samples.h"

namespace comap {
namespace {

using testing::HasSubstr;

MatchVerdict sample(samples::Random& random) {
  const auto number = [&] { return samples::real(random, 0, 100); };
  return {samples::id(random),
          samples::id(random),
          samples::uniform(random, 0, 1) == 1,
          "round_trip",
          number(),
          number(),
          number(),
          number(),
          number(),
          number(),
          number(),
          number(),
          number(),
          number(),
          samples::pose(random),
          samples::information(random)};
}

TEST(MatchVerdictCodec, RoundTrip) {
  samples::Random random(1);
  for (int i = 0; i < 200; ++i) {
    const MatchVerdict verdict = sample(random);
    const auto bytes = encodeMatchVerdict(verdict);
    ASSERT_TRUE(bytes) << bytes.error().text;
    const auto back = decodeMatchVerdict(*bytes);
    ASSERT_TRUE(back) << back.error().text;
    EXPECT_EQ(back->query, verdict.query);
    EXPECT_EQ(back->candidate, verdict.candidate);
    EXPECT_EQ(back->accepted, verdict.accepted);
    EXPECT_EQ(back->reason, verdict.reason);
    EXPECT_EQ(back->fern_dissimilarity, verdict.fern_dissimilarity);
    EXPECT_EQ(back->inlier_ratio, verdict.inlier_ratio);
    EXPECT_EQ(back->rms_sigma, verdict.rms_sigma);
    EXPECT_EQ(back->degeneracy, verdict.degeneracy);
    EXPECT_EQ(back->photometric_median, verdict.photometric_median);
    EXPECT_EQ(back->seen_through, verdict.seen_through);
    EXPECT_EQ(back->unlike, verdict.unlike);
    EXPECT_EQ(back->features, verdict.features);
    EXPECT_EQ(back->round_trip_m, verdict.round_trip_m);
    EXPECT_EQ(back->round_trip_rad, verdict.round_trip_rad);
    EXPECT_TRUE(samples::near(back->T_candidate_query, verdict.T_candidate_query));
    for (int k = 0; k < 36; ++k) {
      const int low = std::min(k / 6, k % 6), high = std::max(k / 6, k % 6);
      EXPECT_EQ(back->information(k / 6, k % 6), verdict.information(low, high));
    }
  }
}

TEST(MatchVerdictCodec, RefusesInformationThatIsNone) {
  samples::Random random(2);
  const MatchVerdict good = sample(random);
  MatchVerdict lopsided = good, endless = good, negative = good;
  lopsided.information(0, 5) *= 2;
  endless.information(3, 3) = std::numeric_limits<double>::infinity();
  negative.information(2, 2) = -1;
  for (const MatchVerdict& bad : {lopsided, endless, negative}) {
    const auto bytes = encodeMatchVerdict(bad);
    ASSERT_FALSE(bytes);
    EXPECT_THAT(bytes.error().text, HasSubstr("verdict: information"));
  }
}

TEST(MatchVerdictCodec, NamesTheNumberThatIsNotFinite) {
  samples::Random random(3);
  MatchVerdict verdict = sample(random);
  verdict.rms_sigma = std::nan("");
  const auto bytes = encodeMatchVerdict(verdict);
  ASSERT_FALSE(bytes);
  EXPECT_THAT(bytes.error().text, HasSubstr("verdict: rms_sigma is nan"));
}

TEST(MatchVerdictCodec, SurvivesHostileBytes) {
  samples::Random random(4);
  for (int i = 0; i < 10; ++i) {
    const auto bytes = encodeMatchVerdict(sample(random));
    ASSERT_TRUE(bytes);
    samples::abuse(random, *bytes, [](auto bad) {
      const auto verdict = decodeMatchVerdict(bad);
      if (!verdict) return false;
      EXPECT_TRUE(verdict->information.allFinite());
      EXPECT_TRUE(verdict->T_candidate_query.isFinite());
      return true;
    });
  }
}

}  // namespace
}  // namespace comap
