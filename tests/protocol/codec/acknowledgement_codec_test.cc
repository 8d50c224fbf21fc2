#include "protocol/codec/acknowledgement_codec.h"

#include <gmock/gmock.h>

#include "tests/protocol/codec/samples.h"

namespace comap {
namespace {

using testing::HasSubstr;

Acknowledgement sample(samples::Random& random) {
  Acknowledgement ack{samples::robot(random),
                      random(),
                      static_cast<uint32_t>(samples::uniform(random, 0, 100000)),
                      {},
                      static_cast<uint32_t>(samples::uniform(random, 0, 100000)),
                      samples::uniform(random, 0, 1) ? "another fern book" : ""};
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
    EXPECT_EQ(back->refusal, ack.refusal);
  }
}

TEST(AcknowledgementCodec, RefusesListsOutOfOrder) {
  for (const std::vector<uint32_t>& held :
       {std::vector<uint32_t>{7, 6}, std::vector<uint32_t>{6, 6}, std::vector<uint32_t>{5}, std::vector<uint32_t>{4}}) {
    const auto bytes = encodeAcknowledgement({"a", 1, 5, held, ""});
    ASSERT_FALSE(bytes);
    EXPECT_THAT(bytes.error().text, HasSubstr("also_held"));
  }
  EXPECT_FALSE(encodeAcknowledgement({"a", 1, 0, std::vector<uint32_t>(kMaxAlsoHeld + 1, 1), ""}));
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
