#include "edge_agent/capture/rate_rule.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

constexpr int64_t kMs = 1'000'000, kPeriod = 33 * kMs;

void work(RateRule& rule, int64_t ms, int frames) {
  for (int i = 0; i < frames; ++i) rule.worked(ms * kMs, kPeriod);
}

TEST(RateRule, TakesAllWhileThereIsTime) {
  RateRule rule;
  work(rule, 25, 200);
  EXPECT_EQ(rule.every(), 1);
  EXPECT_TRUE(rule.due(1, 0));
}

TEST(RateRule, OneSlowFrameChangesNothing) {
  RateRule rule;
  work(rule, 10, 50);
  work(rule, 120, 1);
  work(rule, 10, 50);
  EXPECT_EQ(rule.every(), 1);
}

TEST(RateRule, GoesAsFarAsNeededAndBack) {
  RateRule rule;
  work(rule, 80, 100);  // 2.4 periods
  EXPECT_EQ(rule.every(), 3);
  EXPECT_FALSE(rule.due(66 * kMs, 0));
  EXPECT_TRUE(rule.due(99 * kMs, 0));
  EXPECT_TRUE(rule.due(95 * kMs, 0)) << "cameras are not that even";
  work(rule, 10, 200);
  EXPECT_EQ(rule.every(), 1);
  work(rule, 5000, 1000);
  EXPECT_EQ(rule.every(), 8);
}

TEST(RateRule, DoesNotSwingToAndFro) {
  RateRule rule;
  for (const int64_t ms : {28, 31, 45, 55, 64, 75, 90}) {
    work(rule, ms, 300);
    int changes = 0;
    for (int i = 0; i < 300; ++i) {
      const int before = rule.every();
      work(rule, ms, 1);
      changes += rule.every() != before;
    }
    EXPECT_EQ(changes, 0) << ms << " ms";
  }
}

TEST(RateRule, NeedsAPeriod) {
  RateRule rule;
  for (int i = 0; i < 100; ++i) rule.worked(1000 * kMs, 0);
  EXPECT_EQ(rule.every(), 1);
}

}  // namespace
}  // namespace comap
