// The robot's memory on a recorded kitchen: remembered on the first part of the way, asked on the rest.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <iostream>
#include <map>

#include "edge_agent/capture/tum_source.h"
#include "edge_agent/odometry/relocaliser.h"
#include "mapping_core/ferns/fern_encoder.h"

namespace comap {
namespace {

using Visit = std::function<void(const Pose& T_world_cam, const Pyramid& pyramid, const FernCode& code)>;

// Poses by stamp in milliseconds: `timestamp tx ty tz qx qy qz qw`.
std::map<int64_t, Pose> readTruth(const std::string& path) {
  std::map<int64_t, Pose> truth;
  std::ifstream in(path);
  double stamp_s, x, y, z, qx, qy, qz, qw;
  while (in >> stamp_s >> x >> y >> z >> qx >> qy >> qz >> qw)
    truth[std::llround(stamp_s * 1e3)] = Pose(Eigen::Quaterniond(qw, qx, qy, qz), Eigen::Vector3d(x, y, z));
  return truth;
}

void everyNth(const std::string& folder, TumRange range, size_t step, const Visit& visit) {
  const std::map<int64_t, Pose> truth = readTruth(folder + "/groundtruth.txt");
  auto source = openTum(folder, range);
  ASSERT_TRUE(source);
  const FernBook book = FernBook::standard();
  Pyramid pyramid;
  for (size_t i = 0;; ++i) {
    auto frame = (*source)->next();
    ASSERT_TRUE(frame);
    if (!*frame) return;
    if (i % step != 0) continue;
    const Frame& f = **frame;
    const auto pose = truth.find(std::llround(static_cast<double>(f.stamp_ns) * 1e-6));
    ASSERT_NE(pose, truth.end()) << "no truth for frame " << i;
    buildPyramid(f.colour, f.depth, f.camera, 4, 0.3f, 6, pyramid);
    visit(pose->second, pyramid, encodeFerns(book, f.colour, f.depth));
  }
}

struct Outcome {
  int asked = 0, found = 0;
  double worst_m = 0, worst_deg = 0;
};

Outcome ask(Relocaliser& relocaliser, const std::string& folder, TumRange range, size_t step) {
  Outcome outcome;
  everyNth(folder, range, step, [&](const Pose& T_world_cam, const Pyramid& pyramid, const FernCode& code) {
    ++outcome.asked;
    const Relocalisation place = relocaliser.relocalise(pyramid, code);
    if (!place.accepted) return;
    ++outcome.found;
    const Pose error = T_world_cam.inverse() * place.T_odom_keyframe * place.T_keyframe_cam;
    outcome.worst_m = std::max(outcome.worst_m, error.translation().norm());
    outcome.worst_deg = std::max(outcome.worst_deg, error.angle() * 180 / M_PI);
  });
  return outcome;
}

TEST(RelocaliserRecorded, findsKitchenViewsAndNeverAWrongOne) {
  const char* root = std::getenv("COMAP_DATA_DIR");
  if (root == nullptr) GTEST_SKIP() << "COMAP_DATA_DIR is not set: the recorded sequences are not here";
  const std::string folder = std::string(root) + "/kitchen_dev";
  Relocaliser relocaliser{RelocaliserOptions{}};
  uint32_t sequence = 0;
  everyNth(folder, {0, 200}, 10, [&](const Pose& T_world_cam, const Pyramid& pyramid, const FernCode& code) {
    EXPECT_TRUE(relocaliser.add(sequence++, T_world_cam, code, pyramid));
  });
  ASSERT_EQ(relocaliser.memory().size(), 20u);
  // The way goes on to other parts of the kitchen, and only its first metres are seen from the remembered ones. Back
  // on the way itself, half way between keyframes, nearly all should be found.
  const Outcome ahead = ask(relocaliser, folder, {200, 400}, 5);
  const Outcome along = ask(relocaliser, folder, {5, 200}, 10);
  for (const Outcome& outcome : {ahead, along})
    std::cout << "found " << outcome.found << " of " << outcome.asked << ", worst error " << outcome.worst_m << " m, "
              << outcome.worst_deg << " degrees\n";
  EXPECT_GE(ahead.found, 3);
  EXPECT_GE(along.found, 16);
  for (const Outcome& outcome : {ahead, along}) {
    EXPECT_LT(outcome.worst_m, 0.15);
    EXPECT_LT(outcome.worst_deg, 5);
  }
}

}  // namespace
}  // namespace comap
