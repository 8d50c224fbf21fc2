#include "mapping_core/verify/covisibility.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/scenes/scene.h"

namespace comap {
namespace {

Keyframe keyframeAt(uint32_t sequence, const Pose& T_world_cam) {
  const Frame frame = Scene::room().render(kinectCamera(), T_world_cam);
  Keyframe keyframe;
  keyframe.id = {"alpha", 1, sequence};
  keyframe.camera = frame.camera;
  keyframe.colour = frame.colour;
  keyframe.depth = frame.depth;
  return keyframe;
}

Pose at(double x, double yaw_deg) {
  return Pose(Eigen::Quaterniond(Eigen::AngleAxisd(yaw_deg * M_PI / 180, Eigen::Vector3d::UnitY())), {x, 0, 0});
}

struct Placed {
  std::vector<std::shared_ptr<const KeyframeView>> views;
  std::vector<Sketch> sketches;
  std::vector<PlacedSketch> placed;
};

// Views 0 to 4 pan by 20 degrees each; made once, rendering takes longer than what is tested.
const Placed& panned() {
  static Placed made;
  for (uint32_t i = 0; made.views.size() < 5; ++i) {
    const Keyframe keyframe = keyframeAt(i, at(0.08 * i, 20.0 * i));
    made.views.push_back(makeKeyframeView(keyframe, 6, {}));
    made.sketches.push_back(makeSketch(keyframe, made.views.back()->pyramid, {}));
  }
  for (uint32_t i = 0; made.placed.size() < 5; ++i) made.placed.push_back({&made.sketches[i], at(0.08 * i, 20.0 * i)});
  return made;
}

TEST(Covisibility, findsThoseThatOverlapMostFirst) {
  const auto& placed = panned().placed;
  const auto found = covisibleWith(placed[0], placed, {}, {});
  ASSERT_GE(found.size(), 1u);
  EXPECT_EQ(found[0], 1u);
  for (const size_t i : found) EXPECT_LE(i, 2u) << "60 degrees apart they share too little";
}

TEST(Covisibility, takesNoMoreThanAllowed) {
  CovisibilityOptions options;
  options.per_keyframe = 1;
  const auto& placed = panned().placed;
  EXPECT_EQ(covisibleWith(placed[2], placed, options, {}).size(), 1u);
  options.per_keyframe = 0;
  EXPECT_TRUE(covisibleWith(placed[2], placed, options, {}).empty());
}

TEST(Covisibility, hiddenBehindAWallIsNoOverlap) {
  const Scene near = Scene::plainPlane({0, 0, 2}, {0, 0, -1}), far = Scene::plainPlane({0, 0, 3}, {0, 0, -1});
  std::vector<Sketch> sketches;
  for (const Scene* scene : {&near, &far}) {
    const Frame frame = scene->render(kinectCamera(), {});
    Keyframe keyframe = keyframeAt(static_cast<uint32_t>(sketches.size()), {});
    keyframe.colour = frame.colour;
    keyframe.depth = frame.depth;
    sketches.push_back(makeSketch(keyframe, makeKeyframeView(keyframe, 6, {})->pyramid, {}));
  }
  const std::vector<PlacedSketch> placed = {{&sketches[0], {}}, {&sketches[1], {}}};
  EXPECT_TRUE(covisibleWith(placed[0], placed, {}, {}).empty());
}

TEST(Covisibility, measuresThePoseFromOneThatIsWrongByCentimetres) {
  const auto& views = panned().views;
  const Pose truth = at(0, 0).inverse() * at(0.08, 20);
  const Pose wrong =
      truth * Pose(Eigen::Quaterniond(Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitY())), {0.02, 0, 0.01});
  PointResiduals workspace;
  const auto edge = alignCovisible(*views[0], *views[1], wrong, {}, workspace);
  ASSERT_TRUE(edge);
  EXPECT_EQ(edge->kind, EdgeKind::kCovisibility);
  EXPECT_EQ(edge->from, views[0]->id);
  EXPECT_EQ(edge->to, views[1]->id);
  const Pose error = truth.inverse() * edge->T_from_to;
  EXPECT_LT(error.translation().norm(), 0.0015);
  EXPECT_LT(error.angle(), 0.001);
  EXPECT_GT(edge->information.trace(), 0);
}

TEST(Covisibility, whatTheMapDoesNotExplainIsNoTie) {
  const auto& views = panned().views;
  const Pose truth = at(0, 0).inverse() * at(0.08, 20);
  PointResiduals workspace;
  const Pose far = truth * Pose(Eigen::Quaterniond::Identity(), {0.09, 0, 0});
  EXPECT_FALSE(alignCovisible(*views[0], *views[1], far, {}, workspace));
}

TEST(Covisibility, aBareWallIsNoTie) {
  Keyframe keyframe = keyframeAt(0, {});
  const Frame wall = Scene::plainPlane({0, 0, 2}, {0, 0, -1}).render(kinectCamera(), {});
  keyframe.colour = wall.colour;
  keyframe.depth = wall.depth;
  const auto view = makeKeyframeView(keyframe, 6, {});
  keyframe.id.sequence = 1;
  const auto other = makeKeyframeView(keyframe, 6, {});
  PointResiduals workspace;
  EXPECT_FALSE(alignCovisible(*view, *other, {}, {}, workspace)) << "three directions are open";
}

}  // namespace
}  // namespace comap
