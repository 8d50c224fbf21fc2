#include "protocol/telemetry/time_histogram.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

TEST(TimeHistogram, QuantilesAreRightToAPercent) {
  TimeHistogram histogram;
  for (int i = 1; i <= 100000; ++i) histogram.add(i * 0.001);  // 0.001 to 100 ms
  EXPECT_EQ(histogram.count(), 100000u);
  for (const double q : {0.1, 0.5, 0.95, 0.999}) EXPECT_NEAR(histogram.quantile_ms(q), 100 * q, 0.0101 * 100 * q) << q;
  EXPECT_DOUBLE_EQ(histogram.worst_ms(), 100);
  EXPECT_LE(histogram.quantile_ms(1), 100);
}

TEST(TimeHistogram, OneOutlierIsTheWorstAndNotTheMedian) {
  TimeHistogram histogram;
  for (int i = 0; i < 1000; ++i) histogram.add(8);
  histogram.add(5e6);  // beyond the last bin
  EXPECT_NEAR(histogram.quantile_ms(0.5), 8, 0.08);
  EXPECT_DOUBLE_EQ(histogram.worst_ms(), 5e6);
  EXPECT_GE(histogram.quantile_ms(1), 0.98 * 100e3);
}

TEST(TimeHistogram, NothingIsZeroAndTinyCounts) {
  TimeHistogram histogram;
  EXPECT_EQ(histogram.quantile_ms(0.5), 0);
  histogram.add(0);
  EXPECT_EQ(histogram.count(), 1u);
  EXPECT_EQ(histogram.quantile_ms(0.5), 0);  // never more than the worst
}

}  // namespace
}  // namespace comap
