#include "edge_agent/capture/edge_agreement.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "edge_agent/capture/capture_commands.h"
#include "edge_agent/capture/image_file.h"
#include "tests/files/temporary_folder.h"
#include "tests/scenes/scene.h"
#include "tests/scenes/scene_noise.h"

namespace comap {
namespace {

// The view with its depth moved by whole pixels.
Frame shifted(const Frame& frame, int right, int down) {
  Frame made = frame;
  for (int y = 0; y < frame.depth.height(); ++y)
    for (int x = 0; x < frame.depth.width(); ++x)
      made.depth.at(x, y) =
          frame.depth.contains(x - right, y - down) ? frame.depth.at(x - right, y - down) : uint16_t{0};
  return made;
}

Frame view(int i) {
  return Scene::room().render(
      kinectCamera(), Pose(Eigen::Quaterniond(Eigen::AngleAxisd(0.3 * i, Eigen::Vector3d::UnitY())), {0.1 * i, 0, 0}));
}

TEST(EdgeAgreement, FindsHowFarDepthIsOff) {
  for (const auto& [right, down] : {std::pair{0, 0}, std::pair{4, 0}, std::pair{-3, 2}, std::pair{0, -5}}) {
    EdgeComparison comparison;
    for (int i = 0; i < 6; ++i) comparison.add(shifted(view(i), right, down));
    const EdgeAgreement found = comparison.result();
    EXPECT_TRUE(found.determined()) << found.edges << " " << found.contrast;
    EXPECT_NEAR(found.offset_x_px, -right, 0.7);
    EXPECT_NEAR(found.offset_y_px, -down, 0.7);
    EXPECT_EQ(found.agrees(), right == 0 && down == 0);
  }
}

TEST(EdgeAgreement, KnowsWhereItsSearchEnds) {
  EdgeComparison comparison;
  for (int i = 0; i < 6; ++i) comparison.add(shifted(view(i), 14, 0));
  EXPECT_FALSE(comparison.result().agrees());
  EXPECT_TRUE(!comparison.result().determined() || comparison.result().out_of_reach);
}

TEST(EdgeAgreement, ABareWallTellsNothing) {
  EdgeComparison comparison;
  comparison.add(Scene::plainPlane({0, 0, 2}, {0, 0, -1}).render(kinectCamera(), Pose()));
  EXPECT_FALSE(comparison.result().determined());
  EXPECT_FALSE(comparison.result().agrees());
}

class Views final : public FrameSource {
 public:
  explicit Views(int off) : off_(off) {}
  Result<std::optional<Frame>> next() override {
    if (at_ == 10) return std::optional<Frame>();
    return std::optional<Frame>(shifted(view(at_++), off_, 0));
  }
  size_t size() const override { return 10; }
  std::string description() const override { return "views"; }

 private:
  int off_, at_ = 0;
};

TEST(EdgeAgreement, IsToldWithAPicture) {
  TemporaryFolder folder;
  std::string said;
  const auto log = [&](const std::string& line) { said += line; };
  Views right(0), wrong(6);
  EXPECT_TRUE(checkCalibration(right, folder / "right.png", log));
  EXPECT_THAT(said, testing::HasSubstr("colour and depth agree"));
  const auto refused = checkCalibration(wrong, folder / "wrong.png", log);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kProblem);
  EXPECT_THAT(refused.error().text, testing::HasSubstr("move by -6."));
  const auto green = [&](const std::string& name) {
    const auto picture = readColour(folder / name);
    return picture ? std::count(picture->data(), picture->data() + picture->size(), Rgb{0, 255, 0}) : -1;
  };
  EXPECT_GT(green("right.png"), 2 * green("wrong.png"));
}

}  // namespace
}  // namespace comap
