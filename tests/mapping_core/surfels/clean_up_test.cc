// Each rule that a keyframe judges surfels by, on surfels placed so that no decision is near its threshold: what stays,
// what goes and what is counted is said by hand, and agrees with the scalar oracle without any slack.
#include <gtest/gtest.h>

#include <cmath>

#include "mapping_core/surfels/fusion.h"
#include "tests/mapping_core/gpu/test_device.h"
#include "tests/reference/fusion_reference.h"
#include "tests/reference/stream_reference.h"

namespace comap {
namespace {

const CameraModel kCamera{131.25, 131.25, 79.5, 59.5, 160, 120};
constexpr float kWall_m = 2;  // where sigma is 8.6 mm, the gate 26 mm, and a pixel 15 mm
constexpr float kRadius_m = 0.026f;

struct Case {
  const char* what;
  float z_m;  // of the surfel; the wall is at 2 m
  float confidence = 0;
  uint32_t observations = 0, misses = 0, violations = 0;
  float aside_px = 0;      // from its pixel's centre
  float tilt_deg = 0;      // of its normal, from the wall's
  bool edge_on = false;    // its normal is across its ray instead
  int holes = 0;           // so many of the four corners around its pixel have no depth
  bool with_next = false;  // at the same pixel as the next one
  bool stays = true;
  uint32_t misses_after = 0, violations_after = 0;
};

const std::vector<Case> kCases = {
    {.what = "a sure one on the wall",
     .z_m = 2,
     .confidence = 10,
     .observations = 10,
     .misses = 3,
     .violations = 2,
     .violations_after = 1},
    {.what = "nearest to the pixel's ray", .z_m = 2, .confidence = 10, .observations = 10, .with_next = true},
    {.what = "its less sure double", .z_m = 2, .confidence = 5, .observations = 5, .aside_px = 0.3f, .stays = false},
    {.what = "nearest to the ray, less sure", .z_m = 2, .confidence = 10, .observations = 10, .with_next = true},
    {.what = "its surer double", .z_m = 2, .confidence = 20, .observations = 20, .aside_px = 0.3f},
    {.what = "nearest to the ray again", .z_m = 2, .confidence = 10, .observations = 10, .with_next = true},
    {.what = "no double: another normal",
     .z_m = 2,
     .confidence = 5,
     .observations = 5,
     .aside_px = 0.3f,
     .tilt_deg = 40},
    {.what = "a second wall just behind, often contradicted",
     .z_m = 2.03f,
     .confidence = 10,
     .observations = 20,
     .violations = 4,
     .stays = false},
    {.what = "a second wall just behind, for the first time",
     .z_m = 2.03f,
     .confidence = 10,
     .observations = 20,
     .misses_after = 1,
     .violations_after = 1},
    {.what = "the same seen little: less patience",
     .z_m = 2.03f,
     .confidence = 10,
     .observations = 4,
     .violations = 1,
     .stays = false},
    {.what = "just behind, beside a hole: not hidden",
     .z_m = 2.03f,
     .confidence = 10,
     .observations = 20,
     .violations = 4,
     .holes = 1,
     .violations_after = 4},
    {.what = "just behind, facing elsewhere",
     .z_m = 2.03f,
     .confidence = 10,
     .observations = 20,
     .violations = 4,
     .tilt_deg = 45,
     .violations_after = 4},
    {.what = "well behind: out of sight",
     .z_m = 2.2f,
     .confidence = 10,
     .observations = 20,
     .violations = 4,
     .violations_after = 4},
    {.what = "before the wall, often contradicted",
     .z_m = 1.5f,
     .confidence = 10,
     .observations = 20,
     .violations = 4,
     .stays = false},
    {.what = "before the wall, not often yet",
     .z_m = 1.5f,
     .confidence = 10,
     .observations = 20,
     .violations = 1,
     .misses_after = 1,
     .violations_after = 2},
    {.what = "before the wall, unsure", .z_m = 1.5f, .confidence = 1, .observations = 1, .stays = false},
    {.what = "before the wall, among holes, unsure and out of time",
     .z_m = 1.5f,
     .confidence = 1,
     .observations = 1,
     .misses = 10,
     .holes = 4,
     .stays = false},
    {.what = "before the wall, among holes, unsure, in time",
     .z_m = 1.5f,
     .confidence = 1,
     .observations = 1,
     .misses = 9,
     .holes = 4,
     .misses_after = 10},
    {.what = "before the wall, among holes, sure",
     .z_m = 1.5f,
     .confidence = 10,
     .observations = 10,
     .misses = 30,
     .holes = 4,
     .misses_after = 31},
    {.what = "before the wall, beside three holes, often contradicted",
     .z_m = 1.5f,
     .confidence = 10,
     .observations = 20,
     .violations = 4,
     .holes = 3,
     .stays = false},
    {.what = "before the wall, edge-on, often contradicted",
     .z_m = 1.5f,
     .confidence = 10,
     .observations = 20,
     .violations = 4,
     .edge_on = true,
     .stays = false},
    {.what = "before the wall, edge-on, beside a hole",
     .z_m = 1.5f,
     .confidence = 10,
     .observations = 20,
     .violations = 4,
     .edge_on = true,
     .holes = 1,
     .violations_after = 4},
    {.what = "unsure, behind the wall",
     .z_m = 2.2f,
     .confidence = 1,
     .observations = 1,
     .misses = 10,
     .misses_after = 10},
};

struct Layout {
  DepthImage depth{kCamera.width, kCamera.height, static_cast<uint16_t>(kWall_m* kDepthUnitsPerMetre)};
  std::vector<Surfel> surfels;
  std::vector<std::array<uint32_t, 2>> records;
};

Layout layOut() {
  Layout layout;
  int place = 0;
  for (const Case& one : kCases) {
    const int u = 21 + place % 6 * 24, v = 21 + place / 6 * 24;
    Surfel s;
    s.position = kCamera.unproject(static_cast<double>(u) + one.aside_px, v, one.z_m).cast<float>();
    const float tilt = one.tilt_deg * static_cast<float>(M_PI) / 180;
    s.normal = {std::sin(tilt), 0, -std::cos(tilt)};
    if (one.edge_on) s.normal = Eigen::Vector3f(s.position.z(), 0, -s.position.x()).normalized();
    s.radius = kRadius_m;
    s.confidence = one.confidence;
    s.observations = one.observations;
    layout.surfels.push_back(s);
    layout.records.push_back({0, one.misses | one.violations << 8});
    const std::pair<int, int> corners[] = {{2, 2}, {-2, -2}, {2, -2}, {-2, 2}};
    for (int k = 0; k < one.holes; ++k) layout.depth.at(u + corners[k].first, v + corners[k].second) = 0;
    if (!one.with_next) ++place;
  }
  return layout;
}

TEST(CleanUp, EachRuleDecidesAsSaidAndAsTheOracle) {
  COMAP_DEVICE_OR_SKIP(device);
  gpu::Context& context = device.context();
  const FusionParameters p;
  const Layout layout = layOut();
  StreamRows rows = pack(layout.surfels);
  for (size_t i = 0; i < rows.records.size(); ++i) rows.records[i][1] = layout.records[i][1];
  const auto count = static_cast<uint32_t>(layout.surfels.size());

  auto streams = SurfelStreams::create(context, 1 << 15);
  const auto kernels = SurfelKernels::create(context);
  KeyframeMaps maps;
  FusionScratch scratch;
  const ColourImage grey(kCamera.width, kCamera.height, {128, 128, 128});
  ASSERT_TRUE(streams && kernels && maps.reserve(context, layout.depth.size()) && writeRows(*streams, rows, 0) &&
              maps.upload(grey, layout.depth, {}, p));
  const ChunkRows seen[] = {{&*streams, count}};
  const FusionStep step{framePush(kCamera, Pose(), p), seen, 7, 1};
  const auto inserted = associateKeyframe(context, *kernels, maps, scratch, p, step);
  ASSERT_TRUE(inserted) << inserted.error().text;
  const auto counts = fuseKeyframe(context, *kernels, maps, scratch, p, step);
  ASSERT_TRUE(counts) << counts.error().text;
  const auto after = readRows(*streams, count);
  ASSERT_TRUE(after);
  const auto found = reference::rowsOf(*after);
  std::vector<reference::Row> kept;
  for (size_t i = 0; i < kCases.size(); ++i) {
    SCOPED_TRACE(kCases[i].what);
    EXPECT_EQ(found[i].confidence >= 0, kCases[i].stays);
    if (found[i].confidence < 0) continue;
    EXPECT_EQ(found[i].misses, kCases[i].misses_after);
    EXPECT_EQ(found[i].violations, kCases[i].violations_after);
    kept.push_back(found[i]);
  }

  auto oracle = reference::rowsOf(rows);
  const FusionReport expected =
      reference::fuse(reference::View(kCamera, Pose(), p), oracle, grey, layout.depth, {}, 7, 1);
  EXPECT_EQ(counts->updated, expected.updated);
  EXPECT_EQ(counts->removed[0], expected.removed);
  EXPECT_EQ(*inserted, expected.inserted);
  ASSERT_EQ(kept.size(), expected.total - expected.inserted);
  for (size_t i = 0; i < kept.size(); ++i) {
    SCOPED_TRACE(i);
    EXPECT_LT((kept[i].position - oracle[i].position).norm(), 1e-5f);
    EXPECT_LT((kept[i].normal - oracle[i].normal).norm(), 1e-4f);
    EXPECT_NEAR(kept[i].confidence, oracle[i].confidence, 1e-5f);
    EXPECT_EQ(kept[i].observations, oracle[i].observations);
    EXPECT_EQ(kept[i].misses, oracle[i].misses);
    EXPECT_EQ(kept[i].violations, oracle[i].violations);
  }
}

}  // namespace
}  // namespace comap
