#include "protocol/codec/acknowledgement_codec.h"

#include <gmock/gmock.h>

#include "tests/protocol/codec/samples.h"

namespace comap {
namespace {

using testing::HasSubstr;

Acknowledgement sample(samples::Random& random) {
  Acknowledgement ack;
  ack.robot = samples::robot(random);
  ack.session = random();
  ack.next_expected = static_cast<uint32_t>(samples::uniform(random, 0, 100000));
  ack.mapped_below = static_cast<uint32_t>(samples::uniform(random, 0, 100000));
  if (samples::uniform(random, 0, 1) == 1) ack.refusal = "another fern book";
  if (samples::uniform(random, 0, 1) == 1) ack.refused = "keyframe: protocol major 2, this build speaks 1";
  ack.refused_checksum = static_cast<uint32_t>(random());
  uint32_t sequence = ack.next_expected;
  for (int n = samples::uniform(random, 0, 50); n > 0; --n) {
    sequence += static_cast<uint32_t>(samples::uniform(random, 1, 9));
    ack.also_held.push_back(sequence);
  }
  return ack;
}

TEST(AcknowledgementCodec, RoundTrip) {
  samples::Random random(1);
  for (int i = 0; i < 200; ++i) {
    const Acknowledgement ack = sample(random);
    const auto bytes = encodeAcknowledgement(ack);
    ASSERT_TRUE(bytes) << bytes.error().text;
    const auto back = decodeAcknowledgement(*bytes);
    ASSERT_TRUE(back) << back.error().text;
    EXPECT_EQ(back->robot, ack.robot);
    EXPECT_EQ(back->session, ack.session);
    EXPECT_EQ(back->next_expected, ack.next_expected);
    EXPECT_EQ(back->also_held, ack.also_held);
    EXPECT_EQ(back->mapped_below, ack.mapped_below);
    EXPECT_EQ(back->refused, ack.refused);
    EXPECT_EQ(back->refused_checksum, ack.refused_checksum);
    EXPECT_EQ(back->refusal, ack.refusal);
  }
}

TEST(AcknowledgementCodec, RefusesListsOutOfOrder) {
  for (const std::vector<uint32_t>& held :
       {std::vector<uint32_t>{7, 6}, std::vector<uint32_t>{6, 6}, std::vector<uint32_t>{5}, std::vector<uint32_t>{4}}) {
    Acknowledgement ack;
    ack.robot = "a";
    ack.next_expected = 5;
    ack.also_held = held;
    const auto bytes = encodeAcknowledgement(ack);
    ASSERT_FALSE(bytes);
    EXPECT_THAT(bytes.error().text, HasSubstr("also_held"));
  }
  Acknowledgement endless;
  endless.robot = "a";
  for (uint32_t i = 1; i <= kMaxAlsoHeld + 1; ++i) endless.also_held.push_back(i);
  const auto bytes = encodeAcknowledgement(endless);
  ASSERT_FALSE(bytes);
  EXPECT_THAT(bytes.error().text, HasSubstr("also_held has 65537 entries"));
}

TEST(AcknowledgementCodec, SurvivesHostileBytes) {
  samples::Random random(2);
  for (int i = 0; i < 20; ++i) {
    const auto bytes = encodeAcknowledgement(sample(random));
    ASSERT_TRUE(bytes);
    samples::abuse(random, *bytes, [](auto bad) { return static_cast<bool>(decodeAcknowledgement(bad)); });
  }
}

}  // namespace
}  // namespace comap
