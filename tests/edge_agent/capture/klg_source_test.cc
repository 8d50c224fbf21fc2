#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <cstring>
#include <random>

#include "edge_agent/capture/image_codec.h"
#include "edge_agent/capture/source_uri.h"
#include "tests/files/temporary_folder.h"
#include "tests/scenes/scene.h"

namespace comap {
namespace {

using testing::HasSubstr;

constexpr int kWidth = 64, kHeight = 48;

std::vector<Frame> scene(int frames) {
  std::vector<Frame> made;
  for (int i = 0; i < frames; ++i) {
    made.push_back(Scene::room().render({50, 50, 31.5, 23.5, kWidth, kHeight},
                                        Pose(Eigen::Quaterniond::Identity(), {0.01 * i, 0, 0}), i * 33'333'000));
    for (size_t p = 0; p < made.back().depth.size(); ++p)
      made.back().depth.data()[p] = static_cast<uint16_t>(made.back().depth.data()[p] / 5 * 5);
  }
  return made;
}

template <class T>
void put(std::string& file, T value) {
  file.append(reinterpret_cast<const char*>(&value), sizeof value);
}

struct Style {
  bool compressed = true, jpeg = true, stamps = true;
};

std::string logOf(const std::vector<Frame>& frames, const Style& style) {
  std::string file;
  put(file, static_cast<int32_t>(frames.size()));
  for (const Frame& frame : frames) {
    std::vector<uint16_t> mm(frame.depth.size());
    for (size_t p = 0; p < mm.size(); ++p) mm[p] = static_cast<uint16_t>(frame.depth.data()[p] / 5);
    std::string depth(reinterpret_cast<const char*>(mm.data()), 2 * mm.size());
    if (style.compressed) {
      uLongf size = compressBound(depth.size());
      std::string packed(size, 0);
      EXPECT_EQ(compress2(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(depth.data()),
                          depth.size(), Z_BEST_SPEED),
                Z_OK);
      depth = packed.substr(0, size);
    }
    std::string colour(reinterpret_cast<const char*>(frame.colour.data()), 3 * frame.colour.size());
    if (style.jpeg) {
      const auto jpeg = codec_detail::encodeJpeg(frame.colour, 95, "test").value();
      colour.assign(jpeg.begin(), jpeg.end());
    }
    put(file, style.stamps ? frame.stamp_ns / 1000 : int64_t{0});
    put(file, static_cast<int32_t>(depth.size()));
    put(file, static_cast<int32_t>(colour.size()));
    file += depth + colour;
  }
  return file;
}

CameraConfig config() {
  CameraConfig made;
  made.rig.colour.pinhole = {50, 50, 31.5, 23.5, kWidth, kHeight};
  return made;
}

class KlgSourceTest : public testing::Test {
 protected:
  std::unique_ptr<FrameSource> open(const std::string& content, const std::string& range = "") {
    folder_.write("log.klg", content);
    auto source = openSource("klg:" + (folder_ / "log.klg") + range, config());
    EXPECT_TRUE(source) << source.error().text;
    return source ? std::move(*source) : nullptr;
  }
  Error refusal(const std::string& content, const CameraConfig& camera = config()) {
    folder_.write("log.klg", content);
    auto source = openSource("klg:" + (folder_ / "log.klg"), camera);
    EXPECT_FALSE(source);
    return source ? Error{} : source.error();
  }
  TemporaryFolder folder_;
};

TEST_F(KlgSourceTest, ReadsWhatWasLogged) {
  const auto frames = scene(4);
  for (const bool compressed : {true, false}) {
    for (const bool jpeg : {true, false}) {
      auto source = open(logOf(frames, {compressed, jpeg}));
      EXPECT_EQ(source->size(), 4u);
      for (const Frame& frame : frames) {
        const auto next = source->next();
        ASSERT_TRUE(next && *next) << next.error().text;
        EXPECT_EQ((*next)->stamp_ns, frame.stamp_ns);
        EXPECT_EQ((*next)->depth, frame.depth);
        if (jpeg) {
          EXPECT_NEAR((*next)->colour.at(20, 20).g, frame.colour.at(20, 20).g, 8);
        } else {
          EXPECT_EQ((*next)->colour, frame.colour);
        }
        EXPECT_EQ((*next)->camera, frame.camera);
      }
      EXPECT_FALSE(*source->next());
    }
  }
}

TEST_F(KlgSourceTest, GivesARangeAndMakesUpStampsThatAreNotThere) {
  auto source = open(logOf(scene(5), {true, true, false}), "@2:4");
  EXPECT_EQ(source->size(), 2u);
  EXPECT_THAT(source->description(), HasSubstr("2:4 of 5"));
  const auto first = source->next(), second = source->next();
  ASSERT_TRUE(first && *first && second && *second);
  EXPECT_EQ((*first)->depth, scene(5)[2].depth);
  EXPECT_EQ((*second)->stamp_ns - (*first)->stamp_ns, 33'333'333);
  EXPECT_FALSE(*source->next());
}

TEST_F(KlgSourceTest, ALogThatWasCutOffEndsWithItsLastWholeFrame) {
  const std::string whole = logOf(scene(3), {});
  auto source = open(whole.substr(0, whole.size() - 10));
  EXPECT_EQ(source->size(), 2u);
  EXPECT_NE(source->description().find("cut off: it says it has 3"), std::string::npos) << source->description();
  for (size_t i = 0; i < 2; ++i) {
    const auto frame = source->next();
    ASSERT_TRUE(frame && *frame) << frame.error().text;
    EXPECT_EQ((*frame)->depth, scene(3)[i].depth);
  }
  const auto end = source->next();
  ASSERT_TRUE(end);
  EXPECT_FALSE(*end);
}

TEST_F(KlgSourceTest, RefusesWhatIsNoLog) {
  EXPECT_EQ(refusal("").code, ErrorCode::kBadData);
  EXPECT_EQ(refusal("abc").code, ErrorCode::kBadData);
  EXPECT_EQ(refusal(std::string(100, '\xff')).code, ErrorCode::kBadData);
  EXPECT_EQ(refusal(std::string(100, '\x01')).code, ErrorCode::kBadData);
  CameraConfig unknown = config();
  unknown.rig.colour.pinhole.fx = 0;
  EXPECT_THAT(refusal(logOf(scene(1), {}), unknown).text, HasSubstr("focal lengths"));
  CameraConfig other = config();
  other.rig.colour.pinhole.width = 16;
  EXPECT_THAT(refusal(logOf(scene(1), {false, false}), other).text, HasSubstr("16x48"));
  EXPECT_EQ(openSource("klg:/no/such.klg", config()).error().code, ErrorCode::kUnreachable);
}

TEST_F(KlgSourceTest, DamageIsAnErrorAndNoCrash) {
  const std::string whole = logOf(scene(3), {});
  std::mt19937 random(5);
  int refused = 0, damaged = 0;
  for (int i = 0; i < 400; ++i) {
    std::string content = whole;
    for (auto flips = 1 + random() % 8; flips > 0; --flips)
      content[(i % 4 == 0 ? random() % 64 : random() % content.size())] ^= static_cast<char>(1u << random() % 8);
    folder_.write("log.klg", content);
    auto source = openSource("klg:" + (folder_ / "log.klg"), config());
    if (!source) {
      ++refused;
      continue;
    }
    while (true) {
      const auto next = (*source)->next();
      if (next && !*next) break;
      if (!next) {
        ++damaged;
        EXPECT_EQ(next.error().code, ErrorCode::kBadData);
      }
    }
  }
  EXPECT_GT(refused, 10);
  EXPECT_GT(damaged, 100);
}

}  // namespace
}  // namespace comap
