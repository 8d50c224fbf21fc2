#include "edge_agent/capture/stream_period.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

TEST(StreamPeriod, IsNotKnownBeforeTheSecondPicture) {
  StreamPeriod stream;
  EXPECT_EQ(stream.period_ns(), 0);
  stream.add(0);
  EXPECT_EQ(stream.period_ns(), 0);
  stream.add(100);
  EXPECT_EQ(stream.period_ns(), 100);
}

TEST(StreamPeriod, ALostPictureHardlyMatters) {
  StreamPeriod stream;
  for (const int64_t stamp_ns : {1000, 2000, 3000, 9000}) stream.add(stamp_ns);
  EXPECT_EQ(stream.period_ns(), 1020);
  stream.add(10000);
  EXPECT_EQ(stream.period_ns(), 1000);
}

TEST(StreamPeriod, FollowsAStreamThatBecomesSlower) {
  StreamPeriod stream;
  int64_t stamp_ns = 0;
  for (int i = 0; i < 3; ++i) stream.add(stamp_ns += 1000);
  for (int i = 0; i < 100; ++i) stream.add(stamp_ns += 2000);
  EXPECT_EQ(stream.period_ns(), 2000);
}

TEST(StreamPeriod, AStampThatIsNotLaterTellsNothing) {
  StreamPeriod stream;
  for (const int64_t stamp_ns : {1000, 2000, 2000, 500}) stream.add(stamp_ns);
  EXPECT_EQ(stream.period_ns(), 1000);
  stream.add(1400);
  EXPECT_EQ(stream.period_ns(), 900) << "from the stamp that came last";
}

}  // namespace
}  // namespace comap
