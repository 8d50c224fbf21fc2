#include "robot_api/wire.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <limits>

namespace comap::robot_api {
namespace {

using testing::HasSubstr;

std::vector<uint8_t> bytesOf(const std::string& frame) { return {frame.begin(), frame.end()}; }

Header headerOf(const std::string& frame) {
  std::array<uint8_t, kHeaderBytes> bytes{};
  std::memcpy(bytes.data(), frame.data(), kHeaderBytes);
  const auto header = decodeHeader(bytes, kMaxAnswerBytes);
  EXPECT_TRUE(header);
  EXPECT_EQ(header->body_bytes, frame.size() - kHeaderBytes);
  return *header;
}

std::vector<uint8_t> bodyOf(const std::string& frame) { return bytesOf(frame.substr(kHeaderBytes)); }

PoseNews somePose() {
  PoseNews pose;
  pose.sequence = 7;
  pose.snapshot = 1ull << 40;
  pose.stamp_ns = -5;
  pose.known_at_ns = 123456789012345;
  pose.tracking = 1;
  pose.map_state = 2;
  pose.has_covariance = true;
  pose.map = "a-1-0";
  for (size_t i = 0; i < 7; ++i) {
    pose.T_map_cam[i] = 0.1 * static_cast<double>(i);
    pose.T_map_cam_exact[i] = 0.2 * static_cast<double>(i);
    pose.T_map_odom[i] = -0.3 * static_cast<double>(i);
    pose.T_map_odom_exact[i] = 1e300;
    pose.T_odom_cam[i] = std::numeric_limits<double>::denorm_min();
  }
  for (size_t i = 0; i < 36; ++i) pose.covariance[i] = std::sqrt(static_cast<double>(i));
  return pose;
}

Tile someTile() {
  Tile tile;
  tile.key = {"", -3, 0, 1 << 20};
  tile.revision = 1ull << 50;
  for (uint8_t i = 0; i < 5; ++i)
    tile.surfels.push_back({static_cast<uint16_t>(65535 - i), i, 300, i, 2, 3, 4, 5, 6, 7, 255});
  return tile;
}

TEST(RobotWire, WhatIsSaidIsWhatIsHeard) {
  const PoseNews pose = somePose();
  EXPECT_EQ(headerOf(encode(pose)).kind, static_cast<uint16_t>(Kind::kPose));
  const auto heard = decodePose(bodyOf(encode(pose)));
  ASSERT_TRUE(heard) << heard.error().text;
  EXPECT_EQ(encode(*heard), encode(pose));
  EXPECT_EQ(heard->map, "a-1-0");
  EXPECT_EQ(heard->T_odom_cam, pose.T_odom_cam) << "to the bit";

  const auto tile = decodeTile(bodyOf(encode(someTile())));
  ASSERT_TRUE(tile) << tile.error().text;
  EXPECT_EQ(*tile, someTile());

  Greeting greeting;
  greeting.session = 9;
  greeting.robot = "robot_1";
  const auto greeted = decodeGreeting(bodyOf(encode(greeting)));
  ASSERT_TRUE(greeted);
  EXPECT_EQ(greeted->session, 9u);
  EXPECT_EQ(greeted->robot, "robot_1");

  const auto head = decodeSurfelsHead(bodyOf(encode(SurfelsHead{3, 2, 1ull << 33, "m"})));
  ASSERT_TRUE(head);
  EXPECT_EQ(head->surfels, 1ull << 33);
  const auto refusal = decodeRefusal(bodyOf(encode(Refusal{-4, "too much"})));
  ASSERT_TRUE(refusal);
  EXPECT_EQ(refusal->code, -4);
  EXPECT_EQ(refusal->sentence, "too much");
  const auto ask = decodeAskPose(bodyOf(encode(AskPose{11, 500})));
  ASSERT_TRUE(ask);
  EXPECT_EQ(ask->after, 11u);
  const double inf = std::numeric_limits<double>::infinity();
  const auto box = decodeAskSurfels(bodyOf(encode(AskSurfels{{-1, -inf, 0}, {1, inf, 0}, 4, 5})));
  ASSERT_TRUE(box) << box.error().text;
  EXPECT_EQ(box->most_surfels, 5u);
}

// Whatever is cut off or added.
TEST(RobotWire, EveryMessageThatEndsEarlyIsRefusedAndALongerOneIsTaken) {
  const std::vector<std::pair<std::string, std::function<bool(std::span<const uint8_t>)>>> messages = {
      {encode(Greeting{}), [](auto body) { return bool(decodeGreeting(body)); }},
      {encode(somePose()), [](auto body) { return bool(decodePose(body)); }},
      {encode(SurfelsHead{1, 2, 3, "map"}), [](auto body) { return bool(decodeSurfelsHead(body)); }},
      {encode(someTile()), [](auto body) { return bool(decodeTile(body)); }},
      {encode(Refusal{-1, "no"}), [](auto body) { return bool(decodeRefusal(body)); }},
      {encode(AskPose{1, 2}), [](auto body) { return bool(decodeAskPose(body)); }},
      {encode(AskSurfels{}), [](auto body) { return bool(decodeAskSurfels(body)); }}};
  for (const auto& [frame, decodes] : messages) {
    auto body = bodyOf(frame);
    for (size_t n = 0; n < body.size(); ++n)
      EXPECT_FALSE(decodes({body.data(), n})) << "kind " << headerOf(frame).kind << ", " << n << " bytes";
    EXPECT_TRUE(decodes(body));
    body.push_back(77);
    EXPECT_TRUE(decodes(body)) << "a field of a newer version";
  }
}

TEST(RobotWire, ValuesOutOfRangeAreNamed) {
  std::array<uint8_t, kHeaderBytes> header{1, 2, 0, 0, 16, 0, 0, 0};
  EXPECT_THAT(decodeHeader(header, kMaxRequestBytes).error().text, HasSubstr("length is 513; at most 256"));
  EXPECT_THAT(decodeAskPose(bodyOf(encode(AskPose{0, kLongestWait_ms + 1}))).error().text, HasSubstr("timeout_ms"));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(decodeAskSurfels(bodyOf(encode(AskSurfels{{0, nan, 0}, {1, 1, 1}, 0, 0}))).error().text,
              HasSubstr("box"));
  EXPECT_THAT(decodeAskSurfels(bodyOf(encode(AskSurfels{{0, 2, 0}, {1, 1, 1}, 0, 0}))).error().text, HasSubstr("box"));
  PoseNews pose = somePose();
  pose.T_map_odom[4] = nan;
  EXPECT_THAT(decodePose(bodyOf(encode(pose))).error().text, HasSubstr("T_map_odom"));
  auto tile = bodyOf(encode(someTile()));
  tile[20] = tile[21] = tile[22] = tile[23] = 255;  // surfels
  EXPECT_THAT(decodeTile(tile).error().text, HasSubstr("surfels is 4294967295"));
  auto refusal = bodyOf(encode(Refusal{-1, "no"}));
  refusal[4] = refusal[5] = 255;  // bytes of the sentence
  EXPECT_THAT(decodeRefusal(refusal).error().text, HasSubstr("65535 bytes"));
  EXPECT_THAT(decodeSurfelsHead(bodyOf(encode(SurfelsHead{1, kMaxTiles + 1, 0, ""}))).error().text, HasSubstr("tiles"));
}

}  // namespace
}  // namespace comap::robot_api
