#include "protocol/session/delivery_rate.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

using namespace std::chrono_literals;

const DeliveryRate::Clock::time_point kStart = DeliveryRate::Clock::time_point() + 1h;

TEST(DeliveryRate, IsUnknownAtFirst) {
  const DeliveryRate rate;
  EXPECT_EQ(rate.bytesPerSecond(), 0);
  EXPECT_EQ(rate.bytesWithin(1, 1000), 1000u);
}

TEST(DeliveryRate, OfMessagesUnderWayTogetherIsTheirs) {
  DeliveryRate rate;
  const auto first = rate.mark(kStart), second = rate.mark(kStart);
  rate.delivered(first, 50000, kStart + 500ms);
  EXPECT_NEAR(rate.bytesPerSecond(), 100000, 1);
  rate.delivered(second, 50000, kStart + 1s);
  EXPECT_NEAR(rate.bytesPerSecond(), 100000, 1) << "not half, though it took twice as long";
  EXPECT_EQ(rate.bytesWithin(2, 1000), 200000u);
}

TEST(DeliveryRate, ASenderWithLittleToSayHidesNothingForAWhile) {
  DeliveryRate rate;
  rate.delivered(rate.mark(kStart), 100000, kStart + 100ms);
  EXPECT_NEAR(rate.bytesPerSecond(), 1e6, 1);
  auto now = kStart + 200ms;
  for (; now < kStart + 9s; now += 1s) rate.delivered(rate.mark(now), 1000, now + 100ms);
  EXPECT_NEAR(rate.bytesPerSecond(), 1e6, 1);
  for (; now < kStart + 12s; now += 1s) rate.delivered(rate.mark(now), 1000, now + 100ms);
  EXPECT_NEAR(rate.bytesPerSecond(), 1e4, 1) << "the link may be another by now";
}

TEST(DeliveryRate, AnAnswerInNoTimeIsNoRateWithoutEnd) {
  DeliveryRate rate;
  rate.delivered(rate.mark(kStart), 1000, kStart);
  EXPECT_LE(rate.bytesPerSecond(), 1e6 + 1);
}

}  // namespace
}  // namespace comap
