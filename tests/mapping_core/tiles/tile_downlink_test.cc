#include "mapping_core/tiles/tile_downlink.h"

#include <gtest/gtest.h>

#include <deque>

namespace comap {
namespace {

using namespace std::chrono_literals;

const TileDownlink::Clock::time_point kStart = TileDownlink::Clock::time_point() + 1h;
const MapId kMap = "a-1-0";

TileKey key(int32_t x) { return {kMap, x, 0, 0}; }

TEST(TileDownlink, WhatIsUnderWayCountsAsHeldUntilItIsOverdue) {
  TileDownlink downlink;
  EXPECT_TRUE(downlink.reported(kMap, {}, kStart).empty());
  downlink.sent(key(1), 7, 1000, kStart);
  auto now = kStart;
  for (int i = 0; i < 10; ++i) {
    const auto held = downlink.reported(kMap, {}, now += 500ms);
    if (i == 9) {
      EXPECT_TRUE(held.empty()) << "after 5 s";
      EXPECT_EQ(downlink.underWayBytes(), 0u);
    } else {
      ASSERT_EQ(held.size(), 1u) << i;
      EXPECT_EQ(held[0].revision, 7u);
    }
  }
}

TEST(TileDownlink, FewReportsInLongTimeAreNoLoss) {
  TileDownlink downlink;
  (void)downlink.reported(kMap, {}, kStart);
  downlink.sent(key(1), 7, 1000, kStart);
  EXPECT_EQ(downlink.reported(kMap, {}, kStart + 20s).size(), 1u);
}

TEST(TileDownlink, AnOlderRevisionThatIsReportedLeavesTheNewerUnderWay) {
  TileDownlink downlink;
  (void)downlink.reported(kMap, {}, kStart);
  downlink.sent(key(1), 7, 1000, kStart);
  downlink.sent(key(1), 9, 1500, kStart + 100ms);
  EXPECT_EQ(downlink.underWayBytes(), 1500u) << "the newer one takes the older one's place";
  const std::vector<HeldTile> older = {{key(1), 7}};
  const auto held = downlink.reported(kMap, older, kStart + 500ms);
  ASSERT_EQ(held.size(), 1u);
  EXPECT_EQ(held[0].revision, 9u);
}

TEST(TileDownlink, AReportOfAnotherRevisionDeliversNothing) {
  TileDownlink downlink;
  (void)downlink.reported(kMap, {}, kStart);
  downlink.sent(key(1), 60, 1000, kStart);
  const std::vector<HeldTile> newer = {{key(1), 70}};  // of a core whose store was put back since
  const auto held = downlink.reported(kMap, newer, kStart + 500ms);
  EXPECT_EQ(downlink.underWayBytes(), 1000u);
  ASSERT_EQ(held.size(), 1u);
  EXPECT_EQ(held[0].revision, 60u) << "what it is about to hold";
}

TEST(TileDownlink, WhatTheRobotKnowsToBeGoneItDoesNotHold) {
  TileDownlink downlink;
  const std::vector<HeldTile> holds = {{key(1), 7}, {key(2), 7}}, knows = {{key(1), 9}, {key(2), 7}};
  EXPECT_EQ(downlink.reported(kMap, holds, kStart).size(), 2u);
  downlink.sent(key(1), 9, 50, kStart, true);
  EXPECT_EQ(downlink.held().size(), 1u) << "on its way";
  const auto held = downlink.reported(kMap, knows, kStart + 500ms);
  ASSERT_EQ(held.size(), 1u);
  EXPECT_EQ(held[0].key, key(2));
  EXPECT_EQ(downlink.reported(kMap, knows, kStart + 1s).size(), 1u) << "however often it names it";
  EXPECT_EQ(downlink.reported(kMap, holds, kStart + 20s).size(), 2u) << "it has the tile after all";
  downlink.sent(key(1), 11, 1000, kStart + 20s);
  EXPECT_EQ(downlink.held().size(), 2u) << "it is there again";
}

TEST(TileDownlink, InNoSecondMoreIsSentThanAllowed) {
  TileDownlink downlink;
  (void)downlink.reported(kMap, {}, kStart);
  constexpr size_t kBudget = 50'000;
  std::deque<std::pair<TileDownlink::Clock::time_point, size_t>> sent;
  auto now = kStart;
  size_t in_all = 0;
  for (int32_t i = 0; i < 4000; ++i) {  // 20 s, whenever there is room
    now += 5ms;
    const size_t bytes = 1000 + 700 * static_cast<size_t>(i % 7);
    if (downlink.allowance(kBudget, now) < bytes + TileDownlink::kEnvelope) continue;
    downlink.sent(key(i), 1, bytes, now);
    sent.emplace_back(now, bytes);
    in_all += bytes;
  }
  for (size_t first = 0, next = 0, window = 0; next < sent.size(); ++next) {
    window += sent[next].second;
    while (sent[next].first - sent[first].first >= 1s) window -= sent[first++].second;
    ASSERT_LE(window, kBudget);
  }
  EXPECT_GT(in_all, 19 * kBudget * 7 / 10) << "and what is allowed is used";
}

TEST(TileDownlink, ATileLargerThanASecondsBudgetFindsTheWholeOfItWhenNothingElseWasSent) {
  TileDownlink downlink;
  (void)downlink.reported(kMap, {}, kStart);
  downlink.sent(key(1), 1, 90'000, kStart);
  EXPECT_EQ(downlink.allowance(50'000, kStart), 0u);
  EXPECT_EQ(downlink.allowance(50'000, kStart + 999ms), 0u);
  EXPECT_EQ(downlink.allowance(50'000, kStart + 1s), 50'000u);
}

TEST(TileDownlink, BetweenReportsItKnowsWhatWasSentAndWhetherTheLastIsFresh) {
  TileDownlink downlink;
  EXPECT_FALSE(downlink.fresh(kMap, kStart)) << "it never asked";
  const std::vector<HeldTile> one = {{key(1), 7}};
  (void)downlink.reported(kMap, one, kStart);
  downlink.sent(key(2), 8, 1000, kStart);
  ASSERT_EQ(downlink.held().size(), 2u);
  EXPECT_EQ(downlink.held()[1].revision, 8u);
  EXPECT_TRUE(downlink.fresh(kMap, kStart + 1s));
  EXPECT_FALSE(downlink.fresh("b-1-0", kStart + 1s));
  EXPECT_FALSE(downlink.fresh(kMap, kStart + 4s));
}

TEST(TileDownlink, AnotherMapForgetsAll) {
  TileDownlink downlink;
  (void)downlink.reported(kMap, {}, kStart);
  downlink.sent(key(1), 7, 1000, kStart);
  EXPECT_TRUE(downlink.reported("b-1-0", {}, kStart + 100ms).empty());
  EXPECT_EQ(downlink.underWayBytes(), 0u);
}

// Tiles of 10 kB over a link of so many bytes a second, reported every half second.
struct Played {
  double most_s = 0;  // of queue, after the first ten seconds
  double share = 0;   // of what the link could carry in that time
};

Played play(double bytes_per_s) {
  TileDownlink downlink;
  std::deque<std::pair<TileDownlink::Clock::time_point, int32_t>> queue;
  std::vector<HeldTile> held;
  auto link_free = kStart;
  int32_t next = 0;
  Played played;
  size_t arrived = 0;
  for (auto now = kStart; now < kStart + 40s; now += 500ms) {
    while (!queue.empty() && queue.front().first <= now) {
      held.push_back({key(queue.front().second), 1});
      arrived += now > kStart + 10s ? 10000 : 0;
      queue.pop_front();
    }
    (void)downlink.reported(kMap, held, now);
    while (downlink.room() >= 10000) {
      link_free = std::max(link_free, now) + std::chrono::duration_cast<TileDownlink::Clock::duration>(
                                                 std::chrono::duration<double>(1e4 / bytes_per_s));
      queue.push_back({link_free, next});
      downlink.sent(key(next++), 1, 10000, now);
    }
    if (now > kStart + 10s)
      played.most_s = std::max(played.most_s, std::chrono::duration<double>(link_free - now).count());
  }
  played.share = static_cast<double>(arrived) / (30 * bytes_per_s);
  return played;
}

TEST(TileDownlink, FillsALinkAndMakesNoLongQueue) {
  for (const double rate : {40e3, 125e3, 1e6, 4e6}) {
    const Played played = play(rate);
    EXPECT_GE(played.share, 0.9) << rate;
    EXPECT_LE(played.most_s, 3.1) << rate;
  }
}

}  // namespace
}  // namespace comap
