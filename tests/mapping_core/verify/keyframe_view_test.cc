#include "mapping_core/verify/keyframe_view.h"

#include <gtest/gtest.h>

#include <cmath>

#include "mapping_core/rgbd/alignment.h"
#include "tests/scenes/scene.h"

namespace comap {
namespace {

Keyframe keyframeAt(uint32_t sequence, const Pose& pose) {
  const Frame frame = Scene::room().render(kinectCamera(), pose);
  Keyframe keyframe;
  keyframe.id = {"alpha", 1, sequence};
  keyframe.camera = frame.camera;
  keyframe.colour = frame.colour;
  keyframe.depth = frame.depth;
  return keyframe;
}

std::shared_ptr<const KeyframeView> emptyView(uint32_t sequence) {
  auto view = std::make_shared<KeyframeView>();
  view->id = {"alpha", 1, sequence};
  return view;
}

TEST(KeyframeView, hasBothSidesOfAnAlignment) {
  const auto view = makeKeyframeView(keyframeAt(4, {}), 6, {});
  EXPECT_EQ(view->id.sequence, 4u);
  ASSERT_EQ(view->pyramid.size(), 4u);
  ASSERT_EQ(view->coarse.levels.size(), 2u);
  EXPECT_EQ(view->coarse.levels[0].level, 3);
  EXPECT_EQ(view->coarse.levels[1].level, 2);
  ASSERT_EQ(view->fine.levels.size(), 2u);
  EXPECT_EQ(view->fine.levels[1].level, 1);
  EXPECT_LT(view->coarse.levels[1].count, 1600u);
  EXPECT_GT(view->fine.levels[1].count, 3000u);
}

TEST(KeyframeView, depthBeyondTheLimitIsNotAlignedTo) {
  const auto view = makeKeyframeView(keyframeAt(0, {}), 1.9f, {});
  for (const ReferenceView* reference : {&view->coarse, &view->fine})
    for (const ReferencePoints& points : reference->levels)
      for (size_t i = 0; i < points.count; ++i) EXPECT_LE(points.z[i], 1.9f);
}

TEST(KeyframeView, coarseThenFineFindsTheTruth) {
  const Pose T_world_b(Eigen::Quaterniond(Eigen::AngleAxisd(0.07, Eigen::Vector3d::UnitY())), {0.06, 0, 0.05});
  const auto a = makeKeyframeView(keyframeAt(0, {}), 6, {}), b = makeKeyframeView(keyframeAt(1, T_world_b), 6, {});
  PointResiduals workspace;
  const Alignment coarse = align(a->coarse, b->pyramid, Pose(), {}, workspace);
  const Alignment fine = align(a->fine, b->pyramid, coarse.T_ref_cur, {}, workspace);
  ASSERT_TRUE(fine.solved);
  const Pose error = T_world_b.inverse() * fine.T_ref_cur;
  EXPECT_LT(error.translation().norm(), 0.0015);
  EXPECT_LT(error.angle(), 0.05 * M_PI / 180);
}

TEST(KeyframeViewCache, forgetsTheLeastRecentlyUsed) {
  KeyframeViewCache cache(2);
  EXPECT_EQ(cache.find({"alpha", 1, 0}), nullptr);
  cache.insert(emptyView(0));
  cache.insert(emptyView(1));
  ASSERT_NE(cache.find({"alpha", 1, 0}), nullptr);  // now 1 is the oldest
  cache.insert(emptyView(2));
  EXPECT_NE(cache.find({"alpha", 1, 0}), nullptr);
  EXPECT_EQ(cache.find({"alpha", 1, 1}), nullptr);
  ASSERT_NE(cache.find({"alpha", 1, 2}), nullptr);
  EXPECT_EQ(cache.find({"alpha", 1, 2})->id.sequence, 2u);
}

}  // namespace
}  // namespace comap
