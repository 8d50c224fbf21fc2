#include "protocol/codec/status_codec.h"

#include <gmock/gmock.h>

#include "protocol/codec/core_status_codec.h"
#include "tests/protocol/codec/samples.h"

namespace comap {
namespace {

Status sample(samples::Random& random) {
  const auto number = [&] { return static_cast<uint32_t>(random()); };
  return {samples::robot(random),
          random(),
          static_cast<int64_t>(random()),
          samples::pose(random),
          static_cast<TrackingState>(samples::uniform(random, 0, 2)),
          number(),
          number(),
          number(),
          samples::uniform(random, 0, 1) == 1,
          random(),
          number(),
          number(),
          number(),
          {{random(), 9, {true, 5, samples::pose(random), Matrix6d::Constant(7)}}, {random(), number(), {}}}};
}

TEST(StatusCodec, RoundTrip) {
  samples::Random random(1);
  for (int i = 0; i < 200; ++i) {
    const Status status = sample(random);
    const auto bytes = encodeStatus(status);
    ASSERT_TRUE(bytes) << bytes.error().text;
    const auto back = decodeStatus(*bytes);
    ASSERT_TRUE(back) << back.error().text;
    EXPECT_EQ(back->robot, status.robot);
    EXPECT_EQ(back->session, status.session);
    EXPECT_EQ(back->stamp_ns, status.stamp_ns);
    EXPECT_TRUE(samples::near(back->T_odom_cam, status.T_odom_cam));
    EXPECT_EQ(back->tracking, status.tracking);
    EXPECT_EQ(back->frames, status.frames);
    EXPECT_EQ(back->keyframes, status.keyframes);
    EXPECT_EQ(back->outbox, status.outbox);
    EXPECT_EQ(back->finished, status.finished);
    EXPECT_EQ(back->outbox_bytes, status.outbox_bytes);
    EXPECT_EQ(back->keyframes_thinned, status.keyframes_thinned);
    EXPECT_EQ(back->keyframes_dropped, status.keyframes_dropped);
    EXPECT_EQ(back->keyframes_refused, status.keyframes_refused);
    ASSERT_EQ(back->refused.size(), 2u);
    for (int k = 0; k < 2; ++k) {
      EXPECT_EQ(back->refused[k].session, status.refused[k].session);
      EXPECT_EQ(back->refused[k].sequence, status.refused[k].sequence);
      EXPECT_EQ(back->refused[k].link.linked, status.refused[k].link.linked);
    }
    EXPECT_EQ(back->refused[0].link.linked_to, 5u);
    EXPECT_TRUE(samples::near(back->refused[0].link.T_link_this, status.refused[0].link.T_link_this));
    EXPECT_EQ(back->refused[0].link.information, status.refused[0].link.information);
  }
}

TEST(StatusCodec, RefusesAnUnknownTrackingState) {
  samples::Random random(1);
  Status status = sample(random);
  status.tracking = static_cast<TrackingState>(3);
  EXPECT_FALSE(encodeStatus(status));
}

TEST(StatusCodec, RefusesARefusedKeyframeThatHangsOnALaterOne) {
  samples::Random random(1);
  Status status = sample(random);
  status.refused.front().link.linked_to = status.refused.front().sequence;
  const auto bytes = encodeStatus(status);
  ASSERT_FALSE(bytes);
  EXPECT_THAT(bytes.error().text, testing::HasSubstr("refused: linked_to is 9, expected less"));
}

TEST(StatusCodec, WithTwoRefusedKeyframesItFitsOneDatagram) {
  samples::Random random(1);
  for (int i = 0; i < 200; ++i) {
    Status status = sample(random);
    status.refused[1].link = status.refused[0].link;
    status.refused[0].sequence = status.refused[1].sequence = 4000000000u;
    status.refused[0].link.linked_to = status.refused[1].link.linked_to = 3999999999u;
    const auto bytes = encodeStatus(status);
    ASSERT_TRUE(bytes);
    ASSERT_LE(bytes->size(), 950u);
  }
}

TEST(StatusCodec, RefusesMoreRefusedKeyframesThanALimit) {
  samples::Random random(1);
  Status status = sample(random);
  status.refused.resize(kMaxRefusedTold + 1);
  EXPECT_FALSE(encodeStatus(status));
}

TEST(StatusCodec, SurvivesHostileBytes) {
  samples::Random random(2);
  for (int i = 0; i < 10; ++i) {
    const auto bytes = encodeStatus(sample(random));
    ASSERT_TRUE(bytes);
    samples::abuse(random, *bytes, [](auto bad) {
      const auto status = decodeStatus(bad);
      if (!status) return false;
      EXPECT_LE(static_cast<int>(status->tracking), 2);
      return true;
    });
  }
}

TEST(CoreStatusCodec, RoundTrip) {
  const auto bytes = encodeCoreStatus({1, 2, 4000000000u, "llvmpipe (LLVM 15.0.6, 256 bits)"});
  ASSERT_TRUE(bytes);
  const auto back = decodeCoreStatus(*bytes);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->keyframes, 1u);
  EXPECT_EQ(back->maps, 2u);
  EXPECT_EQ(back->queue, 4000000000u);
  EXPECT_EQ(back->device, "llvmpipe (LLVM 15.0.6, 256 bits)");
  samples::Random random(3);
  samples::abuse(random, *bytes, [](auto bad) { return static_cast<bool>(decodeCoreStatus(bad)); });
}

}  // namespace
}  // namespace comap
