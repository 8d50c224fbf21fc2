#include "mapping_core/ingest/keyframe_ingest.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>

#include "protocol/codec/keyframe_codec.h"

namespace comap {
namespace {

std::vector<uint8_t> encoded(const std::string& robot, uint64_t session, uint32_t sequence, uint32_t skipped = 0) {
  Keyframe keyframe;
  keyframe.id = {robot, session, sequence};
  keyframe.skipped = skipped;
  keyframe.camera = {30, 30, 15.5, 11.5, 32, 24};
  keyframe.colour = ColourImage(32, 24);
  keyframe.depth = DepthImage(32, 24, 5000);
  keyframe.fern_code = {1, std::vector<uint8_t>(10, 3)};
  auto bytes = encodeKeyframe(keyframe);
  EXPECT_TRUE(bytes) << bytes.error().text;
  return *bytes;
}

class KeyframeIngestTest : public testing::Test {
 protected:
  KeyframeIngestTest()
      : path_((std::filesystem::temp_directory_path() / ("ingest-" + std::to_string(getpid()) + ".comap")).string()) {
    std::filesystem::remove(path_);
    auto store = MapStore::open(path_, MapStore::Mode::kCreateOrOpen);
    EXPECT_TRUE(store) << store.error().text;
    store_.emplace(std::move(*store));
    ingest_.emplace(*store_);
  }
  ~KeyframeIngestTest() override {
    store_.reset();
    std::filesystem::remove(path_);
  }

  std::vector<std::string> takeAll() {
    std::vector<std::string> taken;
    while (ingest_->hasNext()) taken.push_back(toString(ingest_->takeNext()));
    return taken;
  }

  std::string path_;
  std::optional<MapStore> store_;
  std::optional<KeyframeIngest> ingest_;
};

TEST_F(KeyframeIngestTest, StoredBeforeItReturns) {
  ASSERT_TRUE(ingest_->ingest(encoded("a", 1, 0)));
  EXPECT_EQ(store_->keyframes()->size(), 1u);
}

TEST_F(KeyframeIngestTest, DuplicatesAreHarmless) {
  EXPECT_TRUE(ingest_->ingest(encoded("a", 1, 0))->is_new);
  EXPECT_FALSE(ingest_->ingest(encoded("a", 1, 0))->is_new);
  EXPECT_EQ(takeAll(), std::vector<std::string>{"a/1/0"});
  EXPECT_EQ(store_->keyframes()->size(), 1u);
}

TEST_F(KeyframeIngestTest, OfOneSessionStrictlyInSequence) {
  ASSERT_TRUE(ingest_->ingest(encoded("a", 1, 2)));
  ASSERT_TRUE(ingest_->ingest(encoded("a", 1, 1)));
  EXPECT_FALSE(ingest_->hasNext());
  EXPECT_EQ(ingest_->waiting(), 2u);
  ASSERT_TRUE(ingest_->ingest(encoded("b", 1, 0)));
  ASSERT_TRUE(ingest_->ingest(encoded("a", 1, 0)));
  EXPECT_EQ(takeAll(), (std::vector<std::string>{"b/1/0", "a/1/0", "a/1/1", "a/1/2"}));
  EXPECT_EQ(ingest_->waiting(), 0u);
}

TEST_F(KeyframeIngestTest, WhatTheRobotDroppedIsNotWaitedForAlsoAfterAStart) {
  const auto arrival = ingest_->ingest(encoded("a", 1, 5, 2));
  ASSERT_TRUE(arrival);
  EXPECT_EQ(arrival->skipped, (std::vector<KeyframeId>{{"a", 1, 3}, {"a", 1, 4}}));
  for (const uint32_t sequence : {6u, 0u, 1u}) ASSERT_TRUE(ingest_->ingest(encoded("a", 1, sequence)));
  EXPECT_EQ(takeAll(), (std::vector<std::string>{"a/1/0", "a/1/1"}));
  KeyframeIngest next(*store_);
  const auto never = next.resume(*store_->keyframes());
  ASSERT_TRUE(never) << never.error().text;
  EXPECT_EQ(*never, (std::vector<KeyframeId>{{"a", 1, 3}, {"a", 1, 4}}));
  ASSERT_TRUE(ingest_->ingest(encoded("a", 1, 2)));
  EXPECT_EQ(takeAll(), (std::vector<std::string>{"a/1/2", "a/1/5", "a/1/6"}));
  ASSERT_TRUE(ingest_->ingest(encoded("a", 1, 4))) << "it comes after all: kept, but mapping has passed it";
  EXPECT_FALSE(ingest_->hasNext());
  EXPECT_EQ(ingest_->waiting(), 0u);
}

TEST_F(KeyframeIngestTest, WhatIsPassedOverIsNotWaitedForAndReadyWhenItComes) {
  for (const uint32_t sequence : {0u, 2u, 3u, 5u}) ASSERT_TRUE(ingest_->ingest(encoded("a", 1, sequence)));
  EXPECT_EQ(takeAll(), std::vector<std::string>{"a/1/0"});
  EXPECT_TRUE(ingest_->passOver({"a", 1, 1}, {}));
  EXPECT_FALSE(ingest_->passOver({"a", 1, 1}, {})) << "known";
  EXPECT_FALSE(ingest_->passOver({"a", 1, 0}, {})) << "mapped";
  EXPECT_FALSE(ingest_->passOver({"a", 1, 5}, {})) << "there";
  EXPECT_TRUE(ingest_->passOver({"a", 1, 6}, {})) << "before it is reached";
  ASSERT_TRUE(ingest_->ingest(encoded("b", 1, 0)));
  EXPECT_EQ(takeAll(), (std::vector<std::string>{"a/1/2", "a/1/3", "b/1/0"}));
  ASSERT_TRUE(ingest_->ingest(encoded("b", 1, 1)));
  ASSERT_TRUE(ingest_->ingest(encoded("a", 1, 4)));
  ASSERT_TRUE(ingest_->ingest(encoded("a", 1, 7)));
  ASSERT_TRUE(ingest_->ingest(encoded("a", 1, 6)));
  ASSERT_TRUE(ingest_->ingest(encoded("a", 1, 1)));
  EXPECT_FALSE(ingest_->ingest(encoded("a", 1, 1))->is_new);
  EXPECT_EQ(takeAll(), (std::vector<std::string>{"b/1/1", "a/1/1", "a/1/4", "a/1/5", "a/1/6", "a/1/7"}))
      << "before those behind it that still wait";
  EXPECT_EQ(ingest_->waiting(), 0u);
}

TEST_F(KeyframeIngestTest, WhatWasPassedOverIsNotWaitedForAfterAStart) {
  for (const uint32_t sequence : {0u, 2u, 3u}) ASSERT_TRUE(ingest_->ingest(encoded("a", 1, sequence)));
  ASSERT_TRUE(store_->setPoses("a-1-0", {{{"a", 1, 0}, Pose()}, {{"a", 1, 2}, Pose()}}));
  KeyframeIngest next(*store_);
  ASSERT_TRUE(next.resume(*store_->keyframes()));
  ASSERT_TRUE(next.hasNext());
  EXPECT_EQ(toString(next.takeNext()), "a/1/3");
  ASSERT_TRUE(next.ingest(encoded("a", 1, 1)));
  ASSERT_TRUE(next.hasNext());
  EXPECT_EQ(toString(next.takeNext()), "a/1/1");
  EXPECT_FALSE(next.hasNext());
}

TEST_F(KeyframeIngestTest, WhatHangsOnThosePassedOverIsTiedToWhatTheyHangOn) {
  const Pose step(Eigen::Quaterniond::Identity(), Eigen::Vector3d(1, 0, 0));
  const Matrix6d sure = Matrix6d::Identity() * 1e4;
  EXPECT_TRUE(ingest_->passOver({"a", 1, 4}, {true, 3, step, sure}));
  EXPECT_TRUE(ingest_->passOver({"a", 1, 3}, {true, 1, step, sure}));
  EXPECT_TRUE(ingest_->passOver({"a", 1, 7}, {}));
  const auto tied = [&](const std::string& robot, uint32_t to) {
    Keyframe keyframe;
    keyframe.id = {robot, 1, 9};
    keyframe.linked = true;
    keyframe.linked_to = to;
    keyframe.T_link_this = step;
    keyframe.information = sure;
    ingest_->tieAcrossGaps(keyframe);
    return keyframe;
  };
  const Keyframe across = tied("a", 4);
  EXPECT_TRUE(across.linked);
  EXPECT_EQ(across.linked_to, 1u);
  EXPECT_NEAR(across.T_link_this.translation().x(), 3, 1e-12);
  EXPECT_NEAR(across.information(3, 3), 1e4 / 3, 1);
  EXPECT_FALSE(tied("a", 7).linked) << "that one began a chain";
  EXPECT_EQ(tied("a", 5).linked_to, 5u);
  EXPECT_EQ(tied("b", 4).linked_to, 4u);
}

TEST_F(KeyframeIngestTest, DamagedBytesAreRefusedAndNotStored) {
  std::vector<uint8_t> bytes = encoded("a", 1, 0);
  bytes.resize(bytes.size() / 2);
  const auto arrival = ingest_->ingest(bytes);
  ASSERT_FALSE(arrival);
  EXPECT_EQ(arrival.error().code, ErrorCode::kBadData);
  EXPECT_TRUE(store_->keyframes()->empty());
  EXPECT_FALSE(ingest_->hasNext());
}

}  // namespace
}  // namespace comap
