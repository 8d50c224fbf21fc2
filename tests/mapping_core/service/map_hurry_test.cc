// A core in a hurry puts off what can wait, and makes up for it.
#include <algorithm>

#include "protocol/codec/keyframe_codec.h"
#include "tests/mapping_core/gpu/test_device.h"
#include "tests/mapping_core/service/room_fleet.h"
#include "tests/mapping_core/store/store_fixture.h"

namespace comap {
namespace {

class MapHurry : public StoreTest {
 protected:
  // As it comes back from the store.
  static Keyframe kept(MapStore& store, const Keyframe& keyframe) {
    keep(store, keyframe);
    const auto encoded = store.encodedKeyframe(keyframe.id);
    EXPECT_TRUE(encoded) << encoded.error().text;
    return *decodeKeyframe(*encoded);
  }
  static std::vector<MatchVerdict> map(MapBuilder& builder, MapStore& store, const std::string& robots, Pace pace) {
    std::vector<MatchVerdict> verdicts;
    for (uint32_t i = 0; i < 5; ++i)
      for (size_t robot = 0; robot < robots.size(); ++robot) {
        const Keyframe keyframe = kept(store, roomKeyframe(robots[robot], i));
        const auto change = builder.addKeyframe(keyframe, static_cast<uint32_t>(robot), pace);
        EXPECT_TRUE(change) << change.error().text;
        if (!change) return verdicts;
        verdicts.insert(verdicts.end(), change->verdicts.begin(), change->verdicts.end());
      }
    return verdicts;
  }
};

TEST_F(MapHurry, TiesAndLoopsAreLookedForLaterAmongWhatWasThere) {
  COMAP_DEVICE_OR_SKIP(device);
  auto store = create();
  ASSERT_TRUE(store);
  MapBuilderOptions options = roomOptions();
  options.live_ties = 3;
  MapBuilder builder(device, *store, options);
  EXPECT_TRUE(map(builder, *store, "a", Pace::kHasty).empty()) << "there is no other map";
  const auto countOf = [&](EdgeKind kind) {
    const auto edges = store->edges();
    EXPECT_TRUE(edges);
    return std::count_if(edges->begin(), edges->end(), [&](const Edge& edge) { return edge.kind == kind; });
  };
  EXPECT_EQ(countOf(EdgeKind::kCovisibility), 0);
  size_t asked = 0, loops = 0;
  for (; builder.hasUnasked() && asked < 100; ++asked) {
    const auto change = builder.askNext();
    ASSERT_TRUE(change) << change.error().text;
    for (const MatchVerdict& verdict : change->verdicts) {
      EXPECT_LT(verdict.candidate.sequence, verdict.query.sequence);
      loops += verdict.accepted;
    }
  }
  EXPECT_EQ(asked, 5u);
  EXPECT_GT(loops, 0u);
  EXPECT_EQ(countOf(EdgeKind::kLoop), static_cast<long>(loops));
  EXPECT_GT(countOf(EdgeKind::kCovisibility), 0) << "ties are made up for, too";
  const auto nothing = builder.askNext();
  ASSERT_TRUE(nothing);
  EXPECT_TRUE(nothing->verdicts.empty());
}

TEST_F(MapHurry, MapsAreJoinedAtOnceAndFusedInFullAtTheEnd) {
  COMAP_DEVICE_OR_SKIP(device);
  auto store = create();
  ASSERT_TRUE(store);
  MapBuilder builder(device, *store, roomOptions());
  map(builder, *store, "ab", Pace::kHasty);
  ASSERT_EQ(builder.components().anchors().size(), 1u) << "other maps are asked about in a hurry, too";
  const KeyframeId anchor = builder.components().anchors().front();
  const size_t coarse = builder.surfelCount(anchor);
  ASSERT_GT(coarse, 0u);
  finish(builder);
  EXPECT_GT(builder.surfelCount(anchor), 2 * coarse);
}

TEST_F(MapHurry, ABriskKeyframeIsCoarseButAskedAndTiedAtOnce) {
  COMAP_DEVICE_OR_SKIP(device);
  MapBuilderOptions options = roomOptions();
  options.live_ties = 3;
  std::vector<size_t> verdicts, edges, surfels;
  for (const Pace pace : {Pace::kThorough, Pace::kBrisk}) {
    auto store = MapStore::open(folder_ / (std::to_string(edges.size()) + ".comap"), MapStore::Mode::kCreateOrOpen);
    ASSERT_TRUE(store);
    MapBuilder builder(device, *store, options);
    verdicts.push_back(map(builder, *store, "ab", pace).size());
    EXPECT_FALSE(builder.hasUnasked());
    ASSERT_EQ(builder.components().anchors().size(), 1u);
    edges.push_back(store->edges()->size());
    surfels.push_back(builder.surfelCount(builder.components().anchors().front()));
  }
  EXPECT_GT(verdicts[0], 0u);
  EXPECT_EQ(verdicts[1], verdicts[0]);
  EXPECT_EQ(edges[1], edges[0]);
  EXPECT_LT(2 * surfels[1], surfels[0]);
}

// A core with time on its hands gives a coarse map its detail, a keyframe at a time, while keyframes go on to come.
TEST_F(MapHurry, ACoarseMapIsRenewedBesideItself) {
  COMAP_DEVICE_OR_SKIP(device);
  auto store = create(), calm_store = MapStore::open(folder_ / "calm.comap", MapStore::Mode::kCreateOrOpen);
  ASSERT_TRUE(store);
  ASSERT_TRUE(calm_store);
  MapBuilder builder(device, *store, roomOptions()), calm(device, *calm_store, roomOptions());
  const auto add = [&](uint32_t i, Pace pace) {
    const Keyframe keyframe = kept(*store, roomKeyframe('a', i));
    keep(*calm_store, roomKeyframe('a', i));
    ASSERT_TRUE(builder.addKeyframe(keyframe, 0, pace));
    ASSERT_TRUE(calm.addKeyframe(keyframe, 0));
  };
  EXPECT_FALSE(builder.coarse());
  for (uint32_t i = 0; i < 3; ++i) add(i, Pace::kBrisk);
  ASSERT_TRUE(builder.coarse());
  const KeyframeId anchor = builder.components().anchors().front();
  const size_t coarse = builder.surfelCount(anchor);
  const auto first = builder.renewCoarse(1);
  ASSERT_TRUE(first);
  EXPECT_FALSE(*first);
  EXPECT_EQ(builder.surfelCount(anchor), coarse) << "the coarse one stays until the other is whole";
  add(3, Pace::kBrisk);
  for (int left = 3; left > 0; --left) {
    EXPECT_TRUE(builder.coarse());
    const auto renewed = builder.renewCoarse(1);
    ASSERT_TRUE(renewed);
    EXPECT_EQ(renewed->has_value(), left == 1) << left;
  }
  EXPECT_FALSE(builder.coarse());
  const auto all = static_cast<double>(calm.surfelCount(anchor));
  EXPECT_NEAR(static_cast<double>(builder.surfelCount(anchor)), all, 0.02 * all);
  EXPECT_FALSE(builder.renewCoarse(1)->has_value());
}

TEST_F(MapHurry, ACoarseMapThatIsJoinedMeanwhileIsRenewedAsAWhole) {
  COMAP_DEVICE_OR_SKIP(device);
  auto store = create();
  ASSERT_TRUE(store);
  MapBuilder builder(device, *store, roomOptions());
  map(builder, *store, "a", Pace::kBrisk);
  ASSERT_TRUE(builder.renewCoarse(1));
  map(builder, *store, "b", Pace::kBrisk);
  ASSERT_EQ(builder.components().anchors().size(), 1u);
  const KeyframeId anchor = builder.components().anchors().front();
  const size_t coarse = builder.surfelCount(anchor), members = builder.components().members(anchor).size();
  for (size_t i = 0; i < members; ++i) {
    ASSERT_TRUE(builder.coarse()) << i;
    ASSERT_TRUE(builder.renewCoarse(1));
  }
  EXPECT_FALSE(builder.coarse());
  EXPECT_GT(builder.surfelCount(anchor), 2 * coarse);
}

TEST_F(MapHurry, AMapThatWasNeverMovedIsFusedInFullToo) {
  COMAP_DEVICE_OR_SKIP(device);
  auto store = create(), calm_store = MapStore::open(folder_ / "calm.comap", MapStore::Mode::kCreateOrOpen);
  ASSERT_TRUE(store);
  ASSERT_TRUE(calm_store);
  MapBuilder builder(device, *store, roomOptions()), calm(device, *calm_store, roomOptions());
  for (uint32_t i = 0; i < 2; ++i) {
    const Keyframe keyframe = kept(*store, roomKeyframe('a', i));
    keep(*calm_store, roomKeyframe('a', i));
    ASSERT_TRUE(builder.addKeyframe(keyframe, 0, Pace::kHasty));
    ASSERT_TRUE(calm.addKeyframe(keyframe, 0));
  }
  EXPECT_NE(hashesOf(builder), hashesOf(calm));
  ASSERT_TRUE(builder.renewCoarse(2));
  EXPECT_EQ(hashesOf(builder), hashesOf(calm)) << "renewed, as if it had never been coarse";
  EXPECT_EQ(finish(builder), finish(calm));
}

}  // namespace
}  // namespace comap
