#include "edge_agent/uplink/make_room.h"

#include <gtest/gtest.h>

#include "tests/edge_agent/uplink/keyframes.h"

namespace comap {
namespace {

// Keyframes 0.1 m apart, but 10 to 19 only 0.01 m.
std::vector<double> path(uint32_t count) {
  std::vector<double> x(count, 0);
  for (uint32_t i = 1; i < count; ++i) x[i] = x[i - 1] + (i >= 10 && i < 20 ? 0.01 : 0.1);
  return x;
}

class MakeRoom : public testing::Test {
 protected:
  void SetUp() override {
    for (uint32_t i = 0; i < kCount; ++i) {
      const Keyframe keyframe = keyframeAt(5, i, x_[i], i > 0 ? x_[i - 1] : 0);
      ASSERT_TRUE(outbox_.add(rowOf(keyframe), *encodeKeyframe(keyframe)));
    }
  }
  RoomMade shrinkTo(uint64_t bytes) {
    RoomMade all;
    for (int i = 0; i < 200 && outbox_.bytes() > bytes; ++i) {
      auto made = makeRoom(outbox_, bytes, 20, cursor_);
      EXPECT_TRUE(made) << made.error().text;
      if (!made) break;
      all.thinned += made->thinned;
      all.dropped.insert(all.dropped.end(), made->dropped.begin(), made->dropped.end());
      if (!made->enough) break;
    }
    return all;
  }
  // Whatever was dropped: what is left stands, link by link, where it was, and tells its gaps.
  void expectWhole() {
    uint32_t next = 0;
    std::map<uint32_t, Keyframe> left;
    for (const OutboxRow& row : rowsFrom(outbox_, 0)) {
      const auto keyframe = decodeKeyframe(bytesOf(outbox_, row.key));
      ASSERT_TRUE(keyframe) << keyframe.error().text;
      EXPECT_EQ(row.key.sequence - keyframe->skipped, next) << row.key.sequence;
      EXPECT_EQ(row.skipped, keyframe->skipped);
      next = row.key.sequence + 1;
      if (keyframe->linked) {
        const auto base = left.find(keyframe->linked_to);
        ASSERT_NE(base, left.end()) << row.key.sequence << " hangs on " << keyframe->linked_to;
        EXPECT_NEAR(x_[base->first] + keyframe->T_link_this.translation().x(), x_[row.key.sequence], 1e-9);
      } else {
        EXPECT_EQ(row.key.sequence, 0u);
      }
      left.emplace(row.key.sequence, *keyframe);
    }
    EXPECT_EQ(next, kCount);
  }

  static constexpr uint32_t kCount = 60;
  const std::vector<double> x_ = path(kCount);
  Outbox outbox_ = memoryOutbox();
  OutboxKey cursor_;
};

TEST_F(MakeRoom, ColourGoesFirstOldestFirst) {
  const uint64_t before = outbox_.bytes();
  const RoomMade made = shrinkTo(before - before / 10);
  EXPECT_GT(made.thinned, 0u);
  EXPECT_TRUE(made.dropped.empty());
  bool fine = false;
  for (const OutboxRow& row : rowsFrom(outbox_, 0)) {
    EXPECT_FALSE(fine && row.thinned) << row.key.sequence;
    fine = !row.thinned;
  }
  EXPECT_TRUE(fine) << "the newest are as they were";
  EXPECT_EQ(outbox_.size(), kCount);
  expectWhole();
}

TEST_F(MakeRoom, ThenTheKeyframesWhoseNeighboursSeeTheSame) {
  const RoomMade all = shrinkTo(1);  // as far as it goes
  EXPECT_EQ(all.thinned, kCount);
  EXPECT_EQ(outbox_.size(), 2u) << "the chain's first, and the last, which has no successor";
  expectWhole();
}

TEST_F(MakeRoom, DroppingIsSpreadAndSparesWhereTheRobotMoved) {
  shrinkTo(0 + outbox_.bytes() / 100 * 40);
  ASSERT_LT(outbox_.size(), 56u);
  ASSERT_GT(outbox_.size(), 20u);
  double longest = 0;
  for (const OutboxRow& row : rowsFrom(outbox_, 1))
    longest = std::max(longest, row.link.T_link_this.translation().norm());
  EXPECT_LE(longest, 0.41);
  expectWhole();
}

TEST_F(MakeRoom, WhatTheCoreMayHoldStaysAsItIs) {
  for (uint32_t i = 0; i < 8; ++i) ASSERT_TRUE(outbox_.markSent({5, i}));
  std::vector<std::vector<uint8_t>> before;
  for (uint32_t i = 0; i < 8; ++i) before.push_back(bytesOf(outbox_, {5, i}));
  shrinkTo(1);
  for (uint32_t i = 0; i < 8; ++i) EXPECT_EQ(*outbox_.encoded({5, i}), before[i]) << i;
  expectWhole();
}

}  // namespace
}  // namespace comap
