#include "edge_agent/realtime_lag.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

using std::chrono::milliseconds;

TEST(RealtimeLag, IsToldAtASecondAndWheneverItHasDoubled) {
  RealtimeLag lag;
  EXPECT_FALSE(lag.note(milliseconds(990), 1));
  const auto first = lag.note(milliseconds(1200), 30);
  ASSERT_TRUE(first);
  EXPECT_NE(first->find("1.2 s behind the recording's own speed after 30 frames"), std::string::npos) << *first;
  EXPECT_FALSE(lag.note(milliseconds(2300), 60));
  EXPECT_TRUE(lag.note(milliseconds(2400), 61));
  EXPECT_FALSE(lag.note(milliseconds(4700), 90));
}

TEST(RealtimeLag, TheMostOfItIsKept) {
  RealtimeLag lag;
  EXPECT_EQ(lag.most_s(), 0);
  for (const int ms : {200, 900, 100}) EXPECT_FALSE(lag.note(milliseconds(ms), 1));
  EXPECT_DOUBLE_EQ(lag.most_s(), 0.9);
}

}  // namespace
}  // namespace comap
