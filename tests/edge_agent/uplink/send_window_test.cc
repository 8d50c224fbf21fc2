#include "edge_agent/uplink/send_window.h"

#include <gtest/gtest.h>

#include <map>

namespace comap {
namespace {

using namespace std::chrono_literals;

const SendWindow::Clock::time_point kStart = SendWindow::Clock::time_point() + 1h;

SendOptions options(uint64_t budget = 0) {
  SendOptions made;
  made.budget_bytes_per_s = budget;
  return made;
}

TEST(SendWindow, OpensWithAcknowledgementsAndIsHalvedWhenTheyStall) {
  SendWindow window(options());
  uint32_t next = 0;
  const auto fill = [&](SendWindow::Clock::time_point now) {
    size_t sent = 0;
    for (; window.hasRoom(now); ++sent) window.sent({1, next++}, 100, now);
    return sent;
  };
  auto now = kStart;
  EXPECT_EQ(fill(now), 2u);
  for (uint32_t i = 0; i < 20; ++i) {
    now += 10ms;
    const OutboxKey key{1, i};
    window.acknowledged({&key, 1}, now);
    fill(now);
  }
  EXPECT_EQ(window.underWay(), 8u);
  EXPECT_TRUE(window.overdue(now + 2900ms).empty());
  now += 3100ms;
  EXPECT_EQ(window.overdue(now).size(), 8u);
  for (const OutboxKey& key : window.overdue(now)) window.sent(key, 100, now);
  EXPECT_TRUE(window.overdue(now + 5900ms).empty()) << "twice as long the second time";
  EXPECT_EQ(window.overdue(now + 6100ms).size(), 8u);
  for (uint32_t i = 20; i < 28; ++i) {
    const OutboxKey key{1, i};
    window.acknowledged({&key, 1}, now);
  }
  EXPECT_EQ(window.underWay(), 0u);
}

TEST(SendWindow, ASlowLinkIsNotFilledWithRepeats) {
  SendWindow window(options());
  auto now = kStart;
  for (uint32_t i = 0; i < 20; ++i) {  // each takes two seconds
    window.sent({1, i}, 100, now);
    now += 2s;
    const OutboxKey key{1, i};
    window.acknowledged({&key, 1}, now);
  }
  window.sent({1, 20}, 100, now);
  EXPECT_TRUE(window.overdue(now + 5s).empty());
  EXPECT_EQ(window.overdue(now + 7s).size(), 1u);
}

// A link of 125 kB/s behind a queue: keyframes of 60 kB arrive one after the other.
TEST(SendWindow, OnASlowLinkNoMoreIsUnderWayThanArrivesInASecond) {
  SendWindow window(options());
  auto now = kStart, link_free = kStart;
  uint32_t next = 0;
  std::map<SendWindow::Clock::time_point, OutboxKey> arrivals;
  size_t most = 0;
  int arrived = 0;
  for (; now < kStart + 60s; now += 10ms) {
    while (window.hasRoom(now)) {
      link_free = std::max(link_free, now) + 480ms;
      arrivals[link_free] = {1, next};
      window.sent({1, next++}, 60000, now);
    }
    if (now > kStart + 10s) most = std::max(most, window.underWay());
    while (!arrivals.empty() && arrivals.begin()->first <= now) {
      window.acknowledged({&arrivals.begin()->second, 1}, now);
      arrivals.erase(arrivals.begin());
      ++arrived;
    }
  }
  EXPECT_NEAR(window.rate().bytesPerSecond(), 125000, 5000);
  EXPECT_LE(most, 2u);
  EXPECT_GE(arrived, 120) << "of 125: the link was kept busy";
}

TEST(SendWindow, AfterAnotherPeerAllIsDueAtOnce) {
  SendWindow window(options());
  window.sent({1, 0}, 100, kStart);
  window.restart();
  EXPECT_EQ(window.overdue(kStart).size(), 1u);
}

TEST(SendWindow, KeepsToItsBudgetInTheMean) {
  SendWindow window(options(1000));
  uint64_t sent = 0;
  uint32_t sequence = 0;
  for (auto now = kStart; now < kStart + 60s; now += 10ms) {
    if (!window.hasRoom(now)) continue;
    const OutboxKey key{1, sequence++};
    window.sent(key, 700, now);
    window.acknowledged({&key, 1}, now);
    sent += 700;
  }
  EXPECT_NEAR(static_cast<double>(sent), 60'000, 2000);
}

}  // namespace
}  // namespace comap
