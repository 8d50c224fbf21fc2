#include "mapping_core/verify/asked_places.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

Pose at(double x_m, double yaw_rad = 0) {
  return Pose(Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitY())), {x_m, 0, 0});
}

Keyframe after(uint32_t sequence, const Pose& T_link_this, uint64_t session = 1) {
  Keyframe keyframe;
  keyframe.id = {"a", session, sequence};
  keyframe.linked = sequence > 0;
  keyframe.linked_to = sequence - 1;
  keyframe.T_link_this = T_link_this;
  return keyframe;
}

const KeyframeId kOne{"b", 1, 7}, kOther{"b", 1, 30};

TEST(AskedPlaces, APlaceIsWhereOneStandsAndWhitherOneLooks) {
  const AskedPlaces asked({});
  EXPECT_TRUE(asked.samePlace(at(2), at(2.3)));
  EXPECT_FALSE(asked.samePlace(at(2), at(2.5)));
  EXPECT_TRUE(asked.samePlace(at(2), at(2, 0.3)));
  EXPECT_FALSE(asked.samePlace(at(2), at(2, 0.4)));
}

TEST(AskedPlaces, TheKeyframeBeforeSpeaksForOneThatStandsThere) {
  AskedPlaces asked({});
  const std::map<KeyframeId, Pose> known = {{kOne, at(0)}, {kOther, at(5)}};
  EXPECT_TRUE(asked.refusedBefore(after(0, {}), known).empty());
  asked.note({"a", 1, 0}, {kOne, kOther});
  EXPECT_EQ(asked.refusedBefore(after(1, at(0.2)), known), (std::vector{kOne, kOther}));
  EXPECT_TRUE(asked.refusedBefore(after(1, at(0.6)), known).empty()) << "it has moved on";
  EXPECT_TRUE(asked.refusedBefore(after(2, at(0.2)), known).empty()) << "not the one before";
  EXPECT_TRUE(asked.refusedBefore(after(1, at(0.2), 2), known).empty()) << "another session";
  EXPECT_EQ(asked.refusedBefore(after(1, at(0.2)), {{kOther, at(5)}}), std::vector{kOther}) << "the other is gone";
  Keyframe unlinked = after(1, at(0.2));
  unlinked.linked = false;
  EXPECT_TRUE(asked.refusedBefore(unlinked, known).empty());
}

TEST(AskedPlaces, ARobotsNextSessionTakesThePlaceOfTheLast) {
  AskedPlaces asked({});
  const std::map<KeyframeId, Pose> known = {{kOne, at(0)}, {kOther, at(5)}};
  asked.note({"a", 1, 4}, {kOne});
  asked.note({"c", 1, 4}, {kOne});
  asked.note({"a", 2, 4}, {kOther});
  EXPECT_TRUE(asked.refusedBefore(after(5, at(0.2)), known).empty());
  EXPECT_EQ(asked.refusedBefore(after(5, at(0.2), 2), known), std::vector{kOther});
  Keyframe of_another = after(5, at(0.2));
  of_another.id = {"c", 1, 5};
  EXPECT_EQ(asked.refusedBefore(of_another, known), std::vector{kOne});
}

TEST(AskedPlaces, WhatWasNotAskedIsAskedNext) {
  AskedPlaces asked({});
  const std::map<KeyframeId, Pose> known = {{kOne, at(0)}};
  asked.note({"a", 1, 0}, {kOne});
  asked.note({"a", 1, 1}, {});  // passed over, since the one before was refused
  EXPECT_TRUE(asked.refusedBefore(after(2, at(0.2)), known).empty());
}

}  // namespace
}  // namespace comap
