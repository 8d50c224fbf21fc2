#include "fleet_tools/evaluate/truth_fit.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/scenes/scene.h"

namespace comap {
namespace {

std::shared_ptr<const KeyframeView> viewAt(const Pose& T_world_cam) {
  const Frame frame = Scene::room().render(kinectCamera(), T_world_cam);
  Keyframe keyframe;
  keyframe.id = {"alpha", 1, 0};
  keyframe.camera = frame.camera;
  keyframe.colour = frame.colour;
  keyframe.depth = frame.depth;
  return makeKeyframeView(keyframe, 4, {});
}

Pose at(double x, double yaw_deg) {
  return Pose(Eigen::Quaterniond(Eigen::AngleAxisd(yaw_deg * M_PI / 180, Eigen::Vector3d::UnitY())), {x, 0, 0});
}

TEST(Misfit, isLittleAtTheTruePoseAndGrowsWithTheError) {
  const Pose T_from_to = at(0.1, 5);
  const auto from = viewAt(at(0, 0)), to = viewAt(T_from_to);
  PointResiduals workspace;
  const auto of = [&](const Pose& pose) { return misfit(*from, *to, pose, {}, workspace); };
  const auto right = of(T_from_to), turned = of(T_from_to * at(0, 1.5)), moved = of(T_from_to * at(0.05, 0));
  ASSERT_TRUE(right && turned && moved);
  EXPECT_LT(*right, 1);
  EXPECT_GT(*turned, TruthFit::kFactor * *right);
  EXPECT_GT(*moved, TruthFit::kFactor * *right);
}

TEST(Misfit, viewsThatShareNothingHaveNone) {
  const auto from = viewAt(at(0, 0)), to = viewAt(at(0, 170));
  PointResiduals workspace;
  EXPECT_EQ(misfit(*from, *to, at(0, 170), {}, workspace), std::nullopt);
}

FitStep stepOf(double truth_sigma, double estimate_sigma) {
  FitStep step;
  step.from = {"a", 1, 3};
  step.to = {"a", 1, 4};
  step.truth_sigma = truth_sigma;
  step.estimate_sigma = estimate_sigma;
  return step;
}

TEST(TruthFit, countsWhereOneFitsFarBetter) {
  TruthFit fit;
  fit.steps = {stepOf(1.0, 0.9), stepOf(1.6, 1.0), stepOf(2.8, 0.9), stepOf(0.8, 1.3), stepOf(1.0, 1.4)};
  ASSERT_EQ(fit.contradicted().size(), 2u);
  EXPECT_EQ(fit.contradicted().front()->truth_sigma, 2.8) << "the worst first";
  EXPECT_EQ(fit.truthFitsBetter(), 1u);
  EXPECT_EQ(toJson(fit).at("estimate_fits_better"), 2);
  EXPECT_EQ(toJson(fit).at("contradicted").at(0).at("from"), toString(KeyframeId{"a", 1, 3}));
  EXPECT_NE(fitText(fit).find("2.8 sigma at the truth"), std::string::npos) << fitText(fit);
}

}  // namespace
}  // namespace comap
