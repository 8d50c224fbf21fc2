#include "edge_agent/capture/stamp.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

TEST(Stamp, KeepsNanosecondsADoubleWouldLose) {
  EXPECT_EQ(parseStamp_ns("1305031102.175304001"), 1305031102175304001);
  EXPECT_EQ(parseStamp_ns("1000.033333"), 1000033333000);
  EXPECT_EQ(parseStamp_ns("0.000000"), 0);
  EXPECT_EQ(parseStamp_ns("7"), 7000000000);
  EXPECT_EQ(parseStamp_ns("1.5"), 1500000000);
}

TEST(Stamp, RoundsBelowTheNanosecond) {
  EXPECT_EQ(parseStamp_ns("1.0000000004"), 1000000000);
  EXPECT_EQ(parseStamp_ns("1.0000000005"), 1000000001);
  EXPECT_EQ(parseStamp_ns("1.99999999999"), 2000000000);
  EXPECT_EQ(parseStamp_ns("1.00000000049"), 1000000000);
}

TEST(Stamp, RefusesEverythingElse) {
  for (const char* text : {"", ".", "1.", ".5", "-1.0", "+1", "1e9", "1.0s", " 1.0", "nan", "0x10", "1..0", "1,5",
                           "9000000000", "99999999999999999999"}) {
    EXPECT_FALSE(parseStamp_ns(text)) << text;
  }
}

TEST(Stamp, WritesWhatItReads) {
  EXPECT_EQ(formatStamp(1000033333000), "1000.033333");
  EXPECT_EQ(formatStamp(1000033333333), "1000.033333333");
  EXPECT_EQ(formatStamp(1000000000000), "1000.000000");
  EXPECT_EQ(formatStamp(1), "0.000000001");
  EXPECT_EQ(formatStamp(-1500000000), "-1.500000");
  for (int64_t stamp : {int64_t{1305031102175304001}, int64_t{123456789}, int64_t{8999999999999999999}}) {
    EXPECT_EQ(parseStamp_ns(formatStamp(stamp)), stamp);
  }
}

}  // namespace
}  // namespace comap
