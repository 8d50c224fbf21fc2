// Outbox and AckTracker against a wire that loses, doubles and reorders in both directions.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "protocol/session/ack_tracker.h"
#include "protocol/session/outbox.h"

namespace comap {
namespace {

using namespace std::chrono_literals;

class LossyDelivery : public testing::TestWithParam<int> {};

TEST_P(LossyDelivery, EveryKeyframeArrives) {
  const int loss_percent = GetParam();
  std::mt19937 random(static_cast<uint32_t>(loss_percent) + 1);
  const auto chance = [&](int percent) { return static_cast<int>(random() % 100) < percent; };
  Outbox outbox("r1", 7);
  AckTracker core("r1", 7);
  std::vector<uint32_t> up;
  std::vector<Acknowledgement> down;
  constexpr uint32_t kCount = 400;
  constexpr size_t kWindow = 8;
  uint32_t added = 0, recorded = 0;
  Outbox::Clock::time_point now{};
  int ticks = 0;
  while (added < kCount || !outbox.empty()) {
    ASSERT_LT(++ticks, 100000) << "stuck at " << core.state().next_expected;
    now += 10ms;
    if (added < kCount && chance(30)) {
      ASSERT_TRUE(outbox.add(added++, std::vector<uint8_t>(100)));
    }
    for (const uint32_t sequence : outbox.due(now, kWindow, 100ms)) {
      ASSERT_FALSE(outbox.encoded(sequence).empty());
      if (!chance(loss_percent)) up.push_back(sequence);
      if (chance(5)) up.push_back(sequence);
    }
    ASSERT_LE(outbox.underWay(), kWindow);
    std::shuffle(up.begin(), up.end(), random);
    while (!up.empty() && chance(70)) {
      recorded += core.record(up.back()) ? 1 : 0;
      up.pop_back();
      if (!chance(loss_percent)) down.push_back(core.state());
    }
    std::shuffle(down.begin(), down.end(), random);
    while (!down.empty() && chance(70)) {
      outbox.acknowledge(down.back());
      down.pop_back();
    }
  }
  EXPECT_EQ(recorded, kCount);
  EXPECT_EQ(core.state().next_expected, kCount);
  EXPECT_EQ(outbox.bytes(), 0u);
}

INSTANTIATE_TEST_SUITE_P(LossPercent, LossyDelivery, testing::Values(0, 5, 20, 60));

}  // namespace
}  // namespace comap
