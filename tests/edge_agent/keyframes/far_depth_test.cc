#include "edge_agent/keyframes/far_depth.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

TEST(FarDepth, fillsOnlyWhatHasNone) {
  DepthImage frame(4, 1);
  frame.at(0, 0) = 40000;  // 8 m, and nothing averaged there
  frame.at(1, 0) = 40000;  // 8 m, but the window's mean says 2 m
  frame.at(2, 0) = 30000;  // 6 m: within the range, and the window did not agree
  frame.at(3, 0) = 0;
  DepthImage far(1, 1);  // of another picture
  takeFarDepth(frame, 6, far);
  Image<float> mean_m(4, 1, 0.0f);
  mean_m.at(1, 0) = 2;
  fillFarDepth(far, mean_m);
  EXPECT_EQ(mean_m.at(0, 0), 8);
  EXPECT_EQ(mean_m.at(1, 0), 2);
  EXPECT_EQ(mean_m.at(2, 0), 0);
  EXPECT_EQ(mean_m.at(3, 0), 0);
}

}  // namespace
}  // namespace comap
