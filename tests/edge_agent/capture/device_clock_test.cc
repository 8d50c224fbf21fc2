#include "edge_agent/capture/device_clock.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

constexpr int64_t kMs = 1'000'000, kS = 1000 * kMs;

TEST(DeviceClock, TheShortestDelayCountsAsNone) {
  DeviceClock clock;
  EXPECT_EQ(clock.toHost(5 * kS, 100 * kS + 8 * kMs), 100 * kS + 8 * kMs);
  EXPECT_EQ(clock.toHost(5 * kS + 33 * kMs, 100 * kS + 34 * kMs), 100 * kS + 34 * kMs) << "only 1 ms late";
  const int64_t third = clock.toHost(5 * kS + 66 * kMs, 100 * kS + 90 * kMs);
  EXPECT_NEAR(static_cast<double>(third), 100.0 * kS + 67 * kMs, 0.01 * kMs) << "23 ms late, as its distance tells";
}

TEST(DeviceClock, FollowsADrift) {
  for (const double drift : {-50e-6, 50e-6}) {
    DeviceClock clock;
    int64_t worst = 0;
    for (int64_t i = 0; i < 20'000; ++i) {
      const int64_t host = i * 33 * kMs, device = static_cast<int64_t>(static_cast<double>(host) * (1 + drift));
      const int64_t late = (i * 7919 % 10) * kMs;
      worst = std::max(worst, std::abs(clock.toHost(device, host + late) - host));
    }
    EXPECT_LT(worst, 11 * kMs) << drift;
  }
}

TEST(DeviceClock, BeginsAnewAfterAJump) {
  DeviceClock clock;
  clock.toHost(5 * kS, 100 * kS);
  EXPECT_EQ(clock.toHost(0, 101 * kS), 101 * kS);
  EXPECT_EQ(clock.toHost(33 * kMs, 101 * kS + 33 * kMs), 101 * kS + 33 * kMs);
}

}  // namespace
}  // namespace comap
