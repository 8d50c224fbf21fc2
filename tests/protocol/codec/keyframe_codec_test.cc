#include "protocol/codec/keyframe_codec.h"

#include <gmock/gmock.h>

#include "tests/protocol/codec/samples.h"

namespace comap {
namespace {

using testing::HasSubstr;

TEST(KeyframeCodec, RoundTrip) {
  samples::Random random(1);
  for (int i = 0; i < 20; ++i) {
    Keyframe keyframe = samples::keyframe(random, 64 + i, 48 + 2 * i);
    keyframe.linked = i % 3 != 0;
    if (i % 2 == 0) keyframe.believed = MapPose{samples::map(random), samples::pose(random)};
    keyframe.fern_code.codes.resize(static_cast<size_t>(i * 31), FernCode::kBad);
    const auto bytes = encodeKeyframe(keyframe);
    ASSERT_TRUE(bytes) << bytes.error().text;
    const auto back = decodeKeyframe(*bytes);
    ASSERT_TRUE(back) << back.error().text;
    EXPECT_EQ(back->id, keyframe.id);
    EXPECT_EQ(back->stamp_ns, keyframe.stamp_ns);
    EXPECT_EQ(back->camera, keyframe.camera);
    EXPECT_TRUE(back->depth == keyframe.depth);
    EXPECT_TRUE(back->depth_hits == keyframe.depth_hits);
    EXPECT_EQ(back->colour.width(), keyframe.camera.width);
    EXPECT_EQ(back->fern_code, keyframe.fern_code);
    EXPECT_TRUE(samples::near(back->T_odom_cam, keyframe.T_odom_cam));
    EXPECT_EQ(back->linked, keyframe.linked);
    EXPECT_EQ(back->inlier_ratio, keyframe.inlier_ratio);
    ASSERT_EQ(back->believed.has_value(), keyframe.believed.has_value());
    if (keyframe.believed) {
      EXPECT_EQ(back->believed->map, keyframe.believed->map);
      EXPECT_TRUE(samples::near(back->believed->T_map_cam, keyframe.believed->T_map_cam));
    }
    if (keyframe.linked) {
      EXPECT_EQ(back->linked_to, keyframe.linked_to);
      EXPECT_TRUE(samples::near(back->T_link_this, keyframe.T_link_this));
      EXPECT_LT((back->information - keyframe.information).norm(), 1e-9 * keyframe.information.norm());
    }
    const auto head = decodeKeyframeId(*bytes);
    ASSERT_TRUE(head);
    EXPECT_EQ(head->id, keyframe.id);
    EXPECT_EQ(head->stamp_ns, keyframe.stamp_ns);
  }
}

TEST(KeyframeCodec, RefusesWhatBreaksALimit) {
  samples::Random random(2);
  const Keyframe good = samples::keyframe(random, 64, 48);
  const auto refusal = [&](const std::function<void(Keyframe&)>& spoil) {
    Keyframe bad = good;
    spoil(bad);
    const auto bytes = encodeKeyframe(bad);
    return bytes ? std::string("accepted") : bytes.error().text;
  };
  EXPECT_THAT(refusal([](Keyframe& k) { k.id.robot = "No"; }), HasSubstr("keyframe: id.robot"));
  EXPECT_THAT(refusal([](Keyframe& k) { k.camera.width = 65; }), HasSubstr("colour is not of the camera's size"));
  EXPECT_THAT(refusal([](Keyframe& k) { k.depth = DepthImage(48, 64); }), HasSubstr("depth is not of the camera's"));
  EXPECT_THAT(refusal([](Keyframe& k) { k.depth_hits = Image<uint8_t>(3, 3); }), HasSubstr("depth_hits has not one"));
  EXPECT_THAT(refusal([](Keyframe& k) { k.linked_to = k.id.sequence; }), HasSubstr("linked_to is"));
  EXPECT_THAT(refusal([](Keyframe& k) { k.camera.fx = 0; }), HasSubstr("camera.fx is 0"));
  EXPECT_THAT(refusal([](Keyframe& k) { k.camera.cy = std::nan(""); }), HasSubstr("camera.cy"));
  EXPECT_THAT(refusal([](Keyframe& k) { k.inlier_ratio = 1.1; }), HasSubstr("inlier_ratio"));
  EXPECT_THAT(refusal([](Keyframe& k) { k.information(1, 2) += 1e9; }), HasSubstr("information is not symmetric"));
  EXPECT_THAT(refusal([](Keyframe& k) { k.fern_code.codes[3] = 16; }), HasSubstr("fern_code.codes[3] is 16"));
  EXPECT_THAT(refusal([](Keyframe& k) { k.fern_code.codes.resize(kMaxFerns + 1); }), HasSubstr("4001 ferns"));
}

TEST(KeyframeCodec, SurvivesHostileBytes) {
  samples::Random random(3);
  for (int i = 0; i < 5; ++i) {
    Keyframe keyframe = samples::keyframe(random, 32, 24);
    const auto bytes = encodeKeyframe(keyframe);
    ASSERT_TRUE(bytes);
    samples::abuse(random, *bytes, [](auto bad) {
      const auto head = decodeKeyframeId(bad);
      const auto back = decodeKeyframe(bad);
      // Whatever is a keyframe has a name.
      EXPECT_TRUE(!back || head);
      return static_cast<bool>(back);
    });
  }
}

}  // namespace
}  // namespace comap
