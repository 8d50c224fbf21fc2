// Cutting only what has changed gives the tiles that cutting everything gives, to the bit.
#include "mapping_core/tiles/tile_cutter.h"

#include <gtest/gtest.h>

#include <random>

#include "mapping_core/tiles/tile_index.h"

namespace comap {
namespace {

// A map as it lies in memory: blocks that are appended to, rewritten, emptied, laid together and thrown away.
class Blocks {
 public:
  explicit Blocks(unsigned seed) : engine_(seed) {}

  Surfel surfel() {
    Surfel s;
    for (int i = 0; i < 3; ++i) s.position[i] = draw(-1.2f, 1.2f);
    s.normal = Eigen::Vector3f(draw(-1, 1), draw(-1, 1), 1).normalized();
    s.radius = draw(0.002f, 0.02f);
    s.confidence = draw(0, 6);  // a quarter of them unsure
    s.colour = {static_cast<uint8_t>(draw(0, 255)), 7, 9};
    return s;
  }
  void append(size_t count) {
    std::vector<Surfel>& block = blocks_[next_];
    for (size_t i = 0; i < count; ++i) block.push_back(surfel());
    changed_.insert(next_++);
  }
  // As a keyframe does it: some are moved, by a little or into the next tile, some gain confidence, some go.
  void fuseInto(uint64_t number) {
    std::vector<Surfel>& block = blocks_.at(number);
    for (Surfel& s : block) {
      const float what = draw(0, 1);
      if (what < 0.1f) s.position.x() += draw(-0.01f, 0.01f);
      if (what > 0.1f && what < 0.15f) s.position.y() += 0.5f;
      if (what > 0.2f && what < 0.4f) s.confidence += draw(0, 1.5f);
    }
    std::erase_if(block, [&](const Surfel&) { return draw(0, 1) < 0.03f; });
    changed_.insert(number);
  }
  void touch(uint64_t number) { changed_.insert(number); }
  void empty(uint64_t number) {
    blocks_.at(number).clear();
    changed_.insert(number);
  }
  void drop(uint64_t number) {
    blocks_.erase(number);
    changed_.erase(number);
  }
  void moveAll(float by) {
    for (auto& [number, block] : blocks_) {
      for (Surfel& s : block) s.position.z() += by;
      changed_.insert(number);
    }
  }
  uint64_t any() {
    const auto at = std::next(blocks_.begin(), static_cast<long>(engine_() % blocks_.size()));
    return at->first;
  }
  size_t size() const { return blocks_.size(); }
  float draw(float low, float high) { return std::uniform_real_distribution<float>(low, high)(engine_); }

  std::vector<Surfel> all() const {
    std::vector<Surfel> all;
    for (const auto& [number, block] : blocks_) all.insert(all.end(), block.begin(), block.end());
    return all;
  }
  SurfelChanges take() {
    SurfelChanges changes{++moment_, {}, {}};
    for (const auto& [number, block] : blocks_) changes.blocks.push_back(number);
    std::shuffle(changes.blocks.begin(), changes.blocks.end(), engine_);
    for (const uint64_t number : changed_) changes.changed.push_back({number, blocks_.at(number)});
    changed_.clear();
    return changes;
  }

 private:
  std::mt19937 engine_;
  std::map<uint64_t, std::vector<Surfel>> blocks_;
  std::set<uint64_t> changed_;
  uint64_t next_ = 100, moment_ = 0;
};

// Both ways in the same index would be the same tiles with the same revisions: also what is removed is.
class BothWays {
 public:
  explicit BothWays(const TileOptions& options) : options_(options), cutter_(options) {}
  size_t renew(Blocks& blocks) {
    const size_t changed = some_.change("m", cutter_.cut("m", blocks.take()));
    EXPECT_EQ(changed, all_.update("m", buildTiles("m", blocks.all(), options_)));
    EXPECT_EQ(some_.all(), all_.all());
    return changed;
  }
  const TileIndex& index() const { return some_; }

 private:
  TileOptions options_;
  TileCutter cutter_;
  TileIndex some_, all_;
};

class Cutting : public testing::TestWithParam<float> {};

TEST_P(Cutting, WhatHasChangedGivesTheTilesThatEverythingGives) {
  for (unsigned seed = 0; seed < 4; ++seed) {
    SCOPED_TRACE(seed);
    Blocks blocks(seed);
    BothWays both({1.5f, GetParam()});
    for (int round = 0; round < 60; ++round) {
      for (int i = 0; i < 3; ++i) blocks.append(static_cast<size_t>(blocks.draw(1, 60)));
      blocks.fuseInto(blocks.any());
      blocks.fuseInto(blocks.any());
      blocks.touch(blocks.any());
      if (round % 5 == 4) blocks.empty(blocks.any());
      if (round % 7 == 6) blocks.drop(blocks.any());
      if (round % 20 == 19) blocks.moveAll(0.3f);
      both.renew(blocks);
      if (testing::Test::HasFailure()) return;
    }
    ASSERT_GT(both.index().tiles("m").size(), 50u);
    while (blocks.size() > 0) blocks.drop(blocks.any());
    both.renew(blocks);
    EXPECT_TRUE(both.index().tiles("m").empty());
  }
}

INSTANTIATE_TEST_SUITE_P(Spacing, Cutting, testing::Values(0.0f, 0.01f, 0.04f));

TEST(TileCutter, WhatWasOnlyLookedAtChangesNothing) {
  Blocks blocks(9);
  for (int i = 0; i < 20; ++i) blocks.append(50);
  TileCutter cutter({1.5f, 0.01f});
  EXPECT_EQ(cutter.moment(), 0u);
  EXPECT_GT(cutter.cut("m", blocks.take()).size(), 20u);
  EXPECT_EQ(cutter.moment(), 1u);
  for (int i = 0; i < 20; ++i) blocks.touch(blocks.any());
  EXPECT_TRUE(cutter.cut("m", blocks.take()).empty());
}

TEST(TileCutter, OneSurfelThatLeavesItsTileChangesTwo) {
  Surfel s;
  s.position = {0.1f, 0.1f, 0.1f};
  s.confidence = 5;
  TileCutter cutter({1.5f, 0.01f});
  ASSERT_EQ(cutter.cut("m", {1, {3}, {{3, {s}}}}).size(), 1u);
  s.position.x() = 0.6f;
  const auto tiles = cutter.cut("m", {2, {3}, {{3, {s}}}});
  ASSERT_EQ(tiles.size(), 2u);
  EXPECT_EQ(tiles[0].key, (TileKey{"m", 0, 0, 0}));
  EXPECT_TRUE(tiles[0].empty());
  EXPECT_EQ(tiles[1].surfels.size(), 1u);
}

}  // namespace
}  // namespace comap
