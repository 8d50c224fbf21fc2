#include "mapping_core/verify/merge_check.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/scenes/scene.h"

namespace comap {
namespace {

Sketch sketchOf(const Frame& frame, uint32_t sequence = 0) {
  Keyframe keyframe;
  keyframe.id = {"alpha", 1, sequence};
  keyframe.camera = frame.camera;
  keyframe.colour = frame.colour;
  keyframe.depth = frame.depth;
  Pyramid pyramid;
  buildPyramid(frame.colour, frame.depth, frame.camera, 4, 0.3f, 6, pyramid);
  return makeSketch(keyframe, pyramid, {});
}

Pose at(double x, double yaw_deg) {
  return Pose(Eigen::Quaterniond(Eigen::AngleAxisd(yaw_deg * M_PI / 180, Eigen::Vector3d::UnitY())), {x, 0, 0});
}

// Five views of a room, panning.
struct Walk {
  std::vector<Sketch> sketches;
  std::vector<PlacedSketch> placed;
  explicit Walk(const Scene& scene, double shift_m = 0) {
    std::vector<Pose> poses;
    for (int i = 0; i < 5; ++i) poses.push_back(at(shift_m + 0.1 * i, -40 + 20 * i));
    for (const Pose& pose : poses) sketches.push_back(sketchOf(scene.render(kinectCamera(), pose)));
    for (size_t i = 0; i < poses.size(); ++i) placed.push_back({&sketches[i], poses[i]});
  }
};

// Rendered once: it takes longer than all that is tested here.
const Walk& firstWalk() {
  static const Walk walk(Scene::room(1));
  return walk;
}
const Walk& secondWalk() {
  static const Walk walk(Scene::room(1), 0.05);
  return walk;
}

double contradicted(const Walk& a, const Walk& b, const Pose& T_a_b) {
  const Evidence evidence = weighHypothesis(a.placed, b.placed, T_a_b, {});
  EXPECT_GE(evidence.views, 5u);
  EXPECT_GT(evidence.cells, 10000u);
  return evidence.contradicted();
}

TEST(Sketch, isAnEighthAndLeavesOutEdges) {
  const Sketch sketch = sketchOf(Scene::room().render(kinectCamera(), {}));
  EXPECT_EQ(sketch.depth_m.width(), 80);
  EXPECT_EQ(sketch.colour.height(), 60);
  size_t with = 0, edges = 0;
  for (size_t i = 0; i < sketch.depth_m.size(); ++i) {
    with += sketch.depth_m.data()[i] > 0;
    edges += sketch.depth_m.data()[i] <= 0 && sketch.nearest_m.data()[i] > 0;
    if (sketch.depth_m.data()[i] > 0) {
      EXPECT_GE(sketch.depth_m.data()[i], sketch.nearest_m.data()[i]);
    }
  }
  EXPECT_GT(with, sketch.depth_m.size() / 2);
  EXPECT_GT(edges, 50u) << "the boxes and spheres have outlines";
}

TEST(Sketch, oneViewAgreesWithItself) {
  const Sketch sketch = sketchOf(Scene::room().render(kinectCamera(), {}));
  const Comparison same = compareSketches(sketch, sketch, {}, {});
  EXPECT_EQ(same.visible, same.cells);
  EXPECT_EQ(same.agree, same.cells);
  EXPECT_EQ(same.compared, same.cells);
  EXPECT_EQ(same.through, 0u);
  EXPECT_EQ(same.discoloured, 0u);
}

TEST(Sketch, aWallThatIsNotThereIsSeenThrough) {
  const Scene near = Scene::plainPlane({0, 0, 2}, {0, 0, -1}), far = Scene::plainPlane({0, 0, 3}, {0, 0, -1});
  const Sketch a = sketchOf(near.render(kinectCamera(), {})), b = sketchOf(far.render(kinectCamera(), {}));
  const Comparison through = compareSketches(a, b, {}, {});
  EXPECT_GT(through.through, through.visible * 9 / 10);
  EXPECT_EQ(through.agree, 0u);
  const Comparison hidden = compareSketches(b, a, {}, {});
  EXPECT_EQ(hidden.through, 0u) << "what is hidden behind a wall is no contradiction";
  EXPECT_EQ(hidden.agree, 0u);
}

TEST(Sketch, aNarrowThingSeenThroughIsNoPatch) {
  Frame frame = Scene::plainPlane({0, 0, 2}, {0, 0, -1}).render(kinectCamera(), {});
  const Sketch wall = sketchOf(frame);
  for (int y = 0; y < 480; ++y)
    for (int x = 300; x < 308; ++x) frame.depth.at(x, y) = static_cast<uint16_t>(1.5 * kDepthUnitsPerMetre);
  const Comparison comparison = compareSketches(sketchOf(frame), wall, {}, {});
  EXPECT_EQ(comparison.through, 0u);
}

TEST(MergeCheck, oneRoomDoesNotContradictItself) {
  const Walk &a = firstWalk(), &b = secondWalk();
  EXPECT_LT(contradicted(a, b, {}), 0.001);
}

TEST(MergeCheck, posesAreWrongByCentimetres) {
  const Walk &a = firstWalk(), &b = secondWalk();
  const Pose wrong(Eigen::Quaterniond(Eigen::AngleAxisd(0.008, Eigen::Vector3d::UnitX())), {0.03, 0, 0.02});
  EXPECT_LT(contradicted(a, b, wrong), MergeCheckOptions().contradicted / 2);
}

TEST(MergeCheck, anotherExposureIsNoContradiction) {
  const Walk& a = firstWalk();
  std::vector<Sketch> sketches = a.sketches;
  std::vector<PlacedSketch> placed = a.placed;
  for (size_t i = 0; i < sketches.size(); ++i) {
    placed[i].sketch = &sketches[i];
    for (size_t k = 0; k < sketches[i].colour.size(); ++k) {
      Rgb& c = sketches[i].colour.data()[k];
      for (uint8_t* level : {&c.r, &c.g, &c.b}) *level = static_cast<uint8_t>(20 + 0.7 * *level);
    }
  }
  const Evidence evidence = weighHypothesis(a.placed, placed, {}, {});
  EXPECT_GT(evidence.cells, 10000u);
  EXPECT_LT(evidence.contradicted(), 0.001);
}

TEST(MergeCheck, aRoomOfTheSameShapeButOtherColoursContradicts) {
  const Walk &a = firstWalk(), b(Scene::room(2));
  EXPECT_GT(contradicted(a, b, {}), 2 * MergeCheckOptions().contradicted);
}

TEST(MergeCheck, aWrongPlaceContradicts) {
  const Walk &a = firstWalk(), &b = firstWalk();
  EXPECT_GT(contradicted(a, b, Pose(Eigen::Quaterniond::Identity(), {0, 0, -0.8})), 0.02);
}

TEST(MergeCheck, viewsThatDoNotMeetSayNothing) {
  const Walk &a = firstWalk(), &b = firstWalk();
  const Evidence evidence = weighHypothesis(a.placed, b.placed, Pose(Eigen::Quaterniond::Identity(), {20, 0, 0}), {});
  EXPECT_EQ(evidence.views, 0u);
  EXPECT_EQ(evidence.contradicted(), 0);
}

TEST(MergeCheck, asksNoMoreViewsThanAllowed) {
  const Walk &a = firstWalk(), &b = firstWalk();
  MergeCheckOptions options;
  options.most_pairs = 3;
  EXPECT_LE(weighHypothesis(a.placed, b.placed, {}, options).views, 6u);
}

}  // namespace
}  // namespace comap
