#include "fleet_tools/synth/synth.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "edge_agent/capture/tum_source.h"
#include "fleet_tools/evaluate/metrics_surface.h"
#include "fleet_tools/evaluate/metrics_trajectory.h"
#include "tests/files/temporary_folder.h"

namespace comap {
namespace {

void ignore(size_t, size_t) {}

SynthOptions small(const std::string& out) {
  SynthOptions options;
  options.robots = 2;
  options.frames = 3;
  options.out = out;
  return options;
}

std::map<std::string, std::string> allFiles(const TemporaryFolder& folder, const std::string& name) {
  std::map<std::string, std::string> files;
  const std::filesystem::path root = folder / name;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(root)) {
    const auto relative = std::filesystem::relative(entry.path(), root).string();
    if (entry.is_regular_file()) files[relative] = folder.read(name + "/" + relative);
  }
  return files;
}

TEST(Synth, SameSeedSameBytesWhateverTheThreads) {
  TemporaryFolder folder;
  auto one = small(folder / "one"), two = small(folder / "two"), other = small(folder / "other");
  one.threads = 1;
  two.threads = 3;
  other.seed = 2;
  for (const auto* options : {&one, &two, &other}) {
    auto made = synthesise(*options, ignore);
    ASSERT_TRUE(made) << made.error().text;
    EXPECT_EQ(made->frames, 6u);
  }
  const auto first = allFiles(folder, "one"), second = allFiles(folder, "two"), third = allFiles(folder, "other");
  EXPECT_EQ(first.size(), 2u * (5 + 6) + 2);
  EXPECT_TRUE(first == second);
  ASSERT_TRUE(third.count("a/depth/1000.033333.png"));
  EXPECT_NE(first.at("a/depth/1000.033333.png"), third.at("a/depth/1000.033333.png"));
  EXPECT_NE(first.at("a/rgb/1000.033333.jpg"), third.at("a/rgb/1000.033333.jpg"));
}

// Back-projects every eighth pixel of one frame into another and compares depths, by the truth's poses: metres.
std::vector<double> disagreement(const Frame& from, const Pose& T_world_from, const Frame& to, const Pose& T_world_to) {
  std::vector<double> differences;
  const Pose T_to_from = T_world_to.inverse() * T_world_from;
  for (int y = 4; y < from.camera.height; y += 8) {
    for (int x = 4; x < from.camera.width; x += 8) {
      if (from.depth.at(x, y) == 0) continue;
      const auto point = T_to_from * from.camera.unproject(x, y, from.depth.at(x, y) / kDepthUnitsPerMetre);
      if (point.z() < 0.1) continue;
      const auto pixel = to.camera.project(point);
      const int u = static_cast<int>(std::lround(pixel.x())), v = static_cast<int>(std::lround(pixel.y()));
      if (!to.depth.contains(u, v) || to.depth.at(u, v) == 0) continue;
      differences.push_back(std::abs(point.z() - to.depth.at(u, v) / kDepthUnitsPerMetre));
    }
  }
  std::sort(differences.begin(), differences.end());
  return differences;
}

TEST(Synth, FramesAgreeByTheTruthAndWithTheSurface) {
  for (const bool noise : {false, true}) {
    TemporaryFolder folder;
    SynthOptions options = small(folder / "set");
    options.frames = 24;
    options.robots = 1;
    options.kinect_noise = noise;
    ASSERT_TRUE(synthesise(options, ignore));
    auto source = openTum(folder / "set/a");
    ASSERT_TRUE(source) << source.error().text;
    auto truth = readTrajectory(folder / "set/a/groundtruth.txt");
    ASSERT_TRUE(truth) << truth.error().text;
    ASSERT_EQ(truth->size(), 24u);
    std::vector<Frame> frames;
    for (auto next = (*source)->next(); next && next->has_value(); next = (*source)->next()) {
      EXPECT_EQ((*next)->stamp_ns, (*truth)[frames.size()].stamp_ns);
      frames.push_back(std::move(**next));
    }
    ASSERT_EQ(frames.size(), 24u);

    const auto differences = disagreement(frames[0], (*truth)[0].pose, frames[23], (*truth)[23].pose);
    ASSERT_GT(differences.size(), 1500u) << "the views overlap";
    // Rounding to the nearest pixel moves a point by up to half a pixel on slanted surfaces. With noise, two depths of
    // 3 m differ by about one of the sensor's steps, 26 mm there.
    EXPECT_LT(differences[differences.size() / 2], noise ? 0.02 : 0.0025);
    EXPECT_LT(differences[differences.size() * 8 / 10], noise ? 0.04 : 0.01);

    auto surface = readPly(folder / "set/surface.ply");
    ASSERT_TRUE(surface) << surface.error().text;
    PlyPoints seen;
    for (int y = 0; y < 480; y += 6) {
      for (int x = 0; x < 640; x += 6) {
        const double z = frames[12].depth.at(x, y) / kDepthUnitsPerMetre;
        if (z <= 0 || z > 4.4) continue;
        seen.positions.push_back(((*truth)[12].pose * frames[12].camera.unproject(x, y, z)).cast<float>());
      }
    }
    const auto score = scoreSurface(seen, Pose(), *surface, 2);
    EXPECT_LT(score.accuracy_median_m, noise ? 0.008 : 0.0003);
    EXPECT_LT(score.accuracy_mean_m, noise ? 0.012 : 0.001);
  }
}

TEST(Synth, RefusesWhatItCannotDo) {
  TemporaryFolder folder;
  const auto refused = [&](const SynthOptions& options, const char* word) {
    auto made = synthesise(options, ignore);
    ASSERT_FALSE(made) << word;
    EXPECT_EQ(made.error().code, ErrorCode::kWrongUse) << made.error().text;
    EXPECT_NE(made.error().text.find(word), std::string::npos) << made.error().text;
  };
  auto options = small(folder / "set");
  options.scene = "castle";
  refused(options, "castle");
  options = small(folder / "set");
  options.robots = 5;
  refused(options, "--robots 5");
  options.robots = 0;
  refused(options, "--robots 0");
  options = small(folder / "set");
  options.frames = 0;
  refused(options, "--frames 0");
  options = small("");
  refused(options, "--out");
  folder.write("mine/thesis.txt", "years of work");
  refused(small(folder / "mine"), "not empty");
  EXPECT_EQ(folder.read("mine/thesis.txt"), "years of work");
  refused(small(folder / "mine/thesis.txt"), "not a folder");
}

TEST(Synth, ReplacesAnEarlierSetOfItsOwn) {
  TemporaryFolder folder;
  auto options = small(folder / "set");
  options.frames = 2;
  ASSERT_TRUE(synthesise(options, ignore));
  options.frames = 1;
  options.robots = 1;
  ASSERT_TRUE(synthesise(options, ignore));
  EXPECT_EQ(allFiles(folder, "set").size(), 5u + 2 + 2);
}

}  // namespace
}  // namespace comap
