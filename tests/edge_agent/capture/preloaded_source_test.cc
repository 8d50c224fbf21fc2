#include "edge_agent/capture/preloaded_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace comap {
namespace {

using testing::HasSubstr;

// Three frames, the second of them damaged, and how often it was asked.
class Recording : public FrameSource {
 public:
  explicit Recording(int& asked) : asked_(asked) {}
  Result<std::optional<Frame>> next() override {
    ++asked_;
    if (at_ == 3) return std::optional<Frame>();
    if (++at_ == 2) return Error{ErrorCode::kBadData, "depth/2.png: is cut off"};
    return std::optional<Frame>(Frame{at_, {}, ColourImage(4, 2), DepthImage(4, 2)});
  }
  size_t size() const override { return 3; }
  std::string description() const override { return "three frames"; }

 private:
  int& asked_;
  int at_ = 0;
};

class Camera final : public Recording {
 public:
  using Recording::Recording;
  bool live() const override { return true; }
};

bool never() { return false; }

TEST(PreloadedSource, GivesFramesAndErrorsInTheirOrderWithoutReadingMore) {
  int asked = 0;
  auto source = preload(std::make_unique<Recording>(asked), never);
  ASSERT_TRUE(source);
  EXPECT_EQ(asked, 4);
  EXPECT_EQ((*source)->size(), 3u);
  EXPECT_EQ((*source)->description(), "three frames");
  const auto first = (*source)->next();
  ASSERT_TRUE(first);
  ASSERT_TRUE(*first);
  EXPECT_EQ((*first)->stamp_ns, 1);
  EXPECT_EQ((*first)->colour.size(), 8u);
  const auto damaged = (*source)->next();
  ASSERT_FALSE(damaged);
  EXPECT_EQ(damaged.error().text, "depth/2.png: is cut off");
  EXPECT_EQ((*(*source)->next())->stamp_ns, 3);
  EXPECT_FALSE(*(*source)->next());
  EXPECT_FALSE(*(*source)->next());
  EXPECT_EQ(asked, 4);
}

TEST(PreloadedSource, EndsWhereItWasStopped) {
  int asked = 0;
  const auto source = preload(std::make_unique<Recording>(asked), [&] { return asked == 1; });
  ASSERT_TRUE(source);
  EXPECT_EQ((*(*source)->next())->stamp_ns, 1);
  EXPECT_FALSE(*(*source)->next());
}

TEST(PreloadedSource, RefusesCamerasAndWhatMemoryDoesNotHold) {
  int asked = 0;
  const auto camera = preload(std::make_unique<Camera>(asked), never);
  ASSERT_FALSE(camera);
  EXPECT_EQ(camera.error().code, ErrorCode::kWrongUse);
  EXPECT_EQ(asked, 0);
  const uint64_t frame = 4 * 2 * (sizeof(Rgb) + sizeof(uint16_t));
  EXPECT_TRUE(preload(std::make_unique<Recording>(asked), never, 3 * frame));
  const auto large = preload(std::make_unique<Recording>(asked), never, 3 * frame - 1);
  ASSERT_FALSE(large);
  EXPECT_EQ(large.error().code, ErrorCode::kWrongUse);
  EXPECT_THAT(large.error().text, HasSubstr("three frames: its 3 frames take"));
}

}  // namespace
}  // namespace comap
