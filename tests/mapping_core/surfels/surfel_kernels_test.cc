// Each kernel against its scalar oracle in tests/reference, on small views of an analytic room.
// Tolerances: the device may contract and reorder single-precision arithmetic, so that values differ in the last digits
// and a few decisions at thresholds fall the other way; the share of those is bounded.
#include <gtest/gtest.h>

#include <map>
#include <random>
#include <tuple>

#include "mapping_core/surfels/fusion.h"
#include "mapping_core/surfels/prediction.h"
#include "protocol/types/keyframe.h"
#include "tests/mapping_core/gpu/test_device.h"
#include "tests/reference/fusion_reference.h"
#include "tests/reference/prediction_reference.h"
#include "tests/reference/stream_reference.h"
#include "tests/scenes/scene.h"

namespace comap {
namespace {

const CameraModel kCamera{131.25, 131.25, 79.5, 59.5, 160, 120};

Frame noisyView(const Pose& T_map_cam, uint32_t seed) {
  Frame frame = Scene::room().render(kCamera, T_map_cam);
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 10);  // 2 mm
  for (size_t i = 0; i < frame.depth.size(); ++i) {
    uint16_t& depth = frame.depth.data()[i];
    if (depth == 0) continue;
    depth = random() % 50 == 0 ? uint16_t{0} : static_cast<uint16_t>(std::lround(depth + noise(random)));
  }
  return frame;
}

Pose viewPose(int i) {
  Vector6d twist;
  twist << 0.05 * i, 0.01 * i, 0.03 * i, 0.01 * i, 0.04 * i, -0.01 * i;
  return Pose::exp(twist);
}

// The maps of one keyframe as the device makes them.
struct Measured {
  std::vector<float> filtered;
  std::vector<std::array<float, 4>> measurements;
};

Measured measureOnDevice(gpu::Device& device, const Frame& frame, const Pose& T_map_cam, const FusionParameters& p) {
  KeyframeMaps maps;
  const auto kernels = SurfelKernels::create(device.context());
  EXPECT_TRUE(kernels && maps.reserve(device.context(), frame.depth.size()) &&
              maps.upload(frame.colour, frame.depth, {}, p));
  auto recorder = gpu::Recorder::begin(device.context());
  EXPECT_TRUE(recorder);
  maps.recordMeasure(*recorder, *kernels, framePush(frame.camera, T_map_cam, p));
  EXPECT_TRUE(recorder->submit());
  return {*maps.filtered.read<float>(frame.depth.size()),
          *maps.measurements.read<std::array<float, 4>>(frame.depth.size())};
}

TEST(FilterDepth, MatchesOracle) {
  COMAP_DEVICE_OR_SKIP(device);
  const FusionParameters p;
  const Frame frame = noisyView(Pose(), 1);
  const Measured found = measureOnDevice(device, frame, Pose(), p);
  const auto expected =
      reference::filterDepth(reference::filterDepth(reference::inverseDepth(frame.depth, p), false, p), true, p);
  size_t valid = 0;
  for (size_t i = 0; i < expected.size(); ++i) {
    ASSERT_EQ(found.filtered[i] > 0, expected.data()[i] > 0) << "pixel " << i;
    ASSERT_NEAR(found.filtered[i], expected.data()[i], 1e-5f * (1 + expected.data()[i])) << "pixel " << i;
    valid += expected.data()[i] > 0;
  }
  EXPECT_GT(valid, expected.size() * 9 / 10);
}

TEST(Measure, MatchesOracle) {
  COMAP_DEVICE_OR_SKIP(device);
  const FusionParameters p;
  const Frame frame = noisyView(Pose(), 2);
  const Measured found = measureOnDevice(device, frame, Pose(), p);
  const auto expected = reference::measure(
      reference::View(kCamera, Pose(), p),
      reference::filterDepth(reference::filterDepth(reference::inverseDepth(frame.depth, p), false, p), true, p));
  size_t differ = 0, valid = 0;
  for (size_t i = 0; i < expected.size(); ++i) {
    const auto& m = expected.data()[i];
    const Eigen::Vector3f normal(found.measurements[i][0], found.measurements[i][1], found.measurements[i][2]);
    if ((found.measurements[i][3] > 0) != (m.depth > 0)) {
      ++differ;
      continue;
    }
    if (m.depth <= 0) continue;
    ++valid;
    EXPECT_NEAR(found.measurements[i][3], m.depth, 1e-4f) << "pixel " << i;
    EXPECT_LT((normal - m.normal).norm(), 2e-3f) << "pixel " << i;
  }
  EXPECT_GT(valid, expected.size() / 2);
  EXPECT_LE(differ, expected.size() / 1000);
}

// None, then blocks of 0 to 12 frames.
Image<uint8_t> hitsOf(uint32_t k) {
  if (k % 2 == 0) return {};
  Image<uint8_t> hits((kCamera.width + kHitBlock - 1) / kHitBlock, (kCamera.height + kHitBlock - 1) / kHitBlock);
  for (size_t i = 0; i < hits.size(); ++i) hits.data()[i] = static_cast<uint8_t>((i + k) % 13);
  return hits;
}

// Fuses keyframe after keyframe on the device; before each the oracle starts from the device's own rows, so that one
// decision at a threshold does not spread.
TEST(Fusion, MatchesOracleKeyframeByKeyframe) {
  COMAP_DEVICE_OR_SKIP(device);
  const FusionParameters p;
  auto& context = device.context();
  const auto kernels = SurfelKernels::create(context);
  auto streams = SurfelStreams::create(context, 1 << 15);
  KeyframeMaps maps;
  FusionScratch scratch;
  ASSERT_TRUE(kernels && streams && maps.reserve(context, kCamera.width * kCamera.height));
  uint32_t count = 0;
  for (uint32_t k = 0; k < 5; ++k) {
    const Pose T_map_cam = viewPose(static_cast<int>(k));
    const Frame frame = noisyView(T_map_cam, 10 + k);
    const auto before = readRows(*streams, count);
    ASSERT_TRUE(before);
    auto oracle = reference::rowsOf(*before);
    const FusionReport expected = reference::fuse(reference::View(kCamera, T_map_cam, p), oracle, frame.colour,
                                                  frame.depth, hitsOf(k), k, 1u << (k % 2));
    ASSERT_TRUE(maps.upload(frame.colour, frame.depth, hitsOf(k), p));
    const ChunkRows rows[] = {{&*streams, count}};
    const FusionStep step{framePush(kCamera, T_map_cam, p), rows, k, 1u << (k % 2)};
    const auto inserted = associateKeyframe(context, *kernels, maps, scratch, p, step);
    ASSERT_TRUE(inserted) << inserted.error().text;
    const auto counts = fuseKeyframe(context, *kernels, maps, scratch, p, step);
    ASSERT_TRUE(counts) << counts.error().text;
    ASSERT_TRUE(insertNew(context, *kernels, maps, scratch, step, rows));
    count += *inserted;

    const uint32_t slack = 20 + expected.total / 200;
    EXPECT_NEAR(counts->updated, expected.updated, slack) << "keyframe " << k;
    EXPECT_NEAR(*inserted, expected.inserted, slack) << "keyframe " << k;
    EXPECT_NEAR(counts->removed[0], expected.removed, slack) << "keyframe " << k;
    if (k > 0) {
      EXPECT_GT(counts->updated, 1000u);
    }

    // Row by row where both kept the row: surfels are found by creation order of those there were before.
    const auto after = readRows(*streams, count);
    ASSERT_TRUE(after);
    const auto found = reference::rowsOf(*after);
    std::map<std::tuple<uint32_t, float, float, float>, const reference::Row*> by_place;
    for (const auto& row : oracle) {
      by_place[{row.owner, std::round(row.position.x() * 2000), std::round(row.position.y() * 2000),
                std::round(row.position.z() * 2000)}] = &row;
    }
    size_t alive = 0, matched = 0;
    for (const auto& row : found) {
      if (row.confidence < 0) continue;
      ++alive;
      const auto same = by_place.find({row.owner, std::round(row.position.x() * 2000),
                                       std::round(row.position.y() * 2000), std::round(row.position.z() * 2000)});
      if (same == by_place.end()) continue;
      const reference::Row& other = *same->second;
      matched += (row.position - other.position).norm() < 1e-4f && (row.normal - other.normal).norm() < 5e-3f &&
                 std::abs(row.radius - other.radius) < 1e-4f && std::abs(row.confidence - other.confidence) < 1e-3f &&
                 std::abs(row.precision - other.precision) < 1e-2f && (row.colour - other.colour).norm() < 0.1f &&
                 row.observations == other.observations && row.contributors == other.contributors &&
                 row.misses == other.misses && row.violations == other.violations;
    }
    EXPECT_GT(matched, alive * 95 / 100) << "keyframe " << k << ": " << matched << " of " << alive;
  }
}

// Boxes may keep too much in, never too little; and what lies elsewhere is not looked at.
TEST(ListVisible, FindsAllThatIsInView) {
  COMAP_DEVICE_OR_SKIP(device);
  gpu::Context& context = device.context();
  const auto kernels = SurfelKernels::create(context);
  // Thirty clouds of 700 surfels all around, so that blocks of 1024 end within clouds; the last block is not full.
  std::mt19937 random(5);
  std::normal_distribution<float> scatter(0, 0.1f);
  std::vector<Surfel> surfels;
  for (int cloud = 0; cloud < 30; ++cloud) {
    const float angle = 0.21f * static_cast<float>(cloud), distance = 1 + 0.2f * static_cast<float>(cloud);
    const Eigen::Vector3f centre(distance * std::sin(angle), 0.1f * static_cast<float>(cloud % 5),
                                 distance * std::cos(angle));
    for (int i = 0; i < 700; ++i) {
      Surfel& s = surfels.emplace_back();
      s.position = centre + Eigen::Vector3f(scatter(random), scatter(random), scatter(random));
      s.confidence = 1;
    }
  }
  const auto count = static_cast<uint32_t>(surfels.size());
  auto streams = SurfelStreams::create(context, 1 << 15);
  ASSERT_TRUE(kernels && streams && writeRows(*streams, pack(surfels), 0));
  EXPECT_EQ(streams->boxed, 0u);
  VisibleList list;
  ASSERT_TRUE(list.reserve(context, 1 << 15));
  const ChunkRows rows[] = {{&*streams, count}};
  const float farthest = 5, margin_px = 3;
  for (int view = 0; view < 12; ++view) {
    CameraModel camera = kCamera;
    if (view % 3 == 2) camera.fy = -camera.fy;  // y up
    const Pose T_map_cam(
        Eigen::Quaterniond(Eigen::AngleAxisd(0.53 * view, Eigen::Vector3d(0.1 * (view % 2), 1, 0).normalized())),
        Eigen::Vector3d(0.1 * view, 0, 0));
    const FusionParameters p;
    const FramePush frame = framePush(camera, T_map_cam, p);
    auto recorder = gpu::Recorder::begin(context);
    ASSERT_TRUE(recorder);
    list.record(*recorder, *kernels, *streams, {{frame}, count, 0, farthest, margin_px}, nullptr);
    ASSERT_TRUE(recorder->submit());
    noteBoxes(rows);
    const auto words = list.list.read<uint32_t>(4 + 2 * count);
    ASSERT_TRUE(words);
    std::vector<bool> found(count, false);
    for (uint32_t i = 0; i < (*words)[3]; ++i) found[(*words)[4 + 2 * i]] = true;
    size_t in_view = 0, missed = 0, needless = 0;
    const Eigen::Isometry3f T_cam_map(T_map_cam.inverse().matrix().cast<float>());
    for (uint32_t i = 0; i < count; ++i) {
      const Eigen::Vector3f x = T_cam_map * surfels[i].position;
      const Eigen::Vector2f at(x.x() / x.z() * static_cast<float>(camera.fx) + static_cast<float>(camera.cx),
                               x.y() / x.z() * static_cast<float>(camera.fy) + static_cast<float>(camera.cy));
      const auto inside = [&](float by) {
        return x.z() > 0.05f + by * 1e-3f && x.z() < farthest - by * 1e-3f && at.x() > -margin_px + by &&
               at.y() > -margin_px + by && at.x() < static_cast<float>(camera.width) + margin_px - by &&
               at.y() < static_cast<float>(camera.height) + margin_px - by;
      };
      in_view += inside(0);
      missed += inside(0.01f) && !found[i];
      needless += !inside(-0.01f) && found[i];
    }
    EXPECT_EQ(missed, 0u) << "view " << view;
    EXPECT_EQ(needless, 0u) << "view " << view;
    EXPECT_EQ(std::count(found.begin(), found.end(), true), (*words)[3]) << "listed twice";
    EXPECT_GT(in_view, 100u);
    const auto blocks = list.blocks.read<uint32_t>(4);
    ASSERT_TRUE(blocks);
    EXPECT_LT((*blocks)[0], 14u) << "of 21 blocks, view " << view;
  }
  EXPECT_EQ(streams->boxed, count);
}

TEST(Prediction, MatchesOracle) {
  COMAP_DEVICE_OR_SKIP(device);
  const CameraModel small{65.6, 65.6, 39.5, 29.5, 80, 60};
  const FusionParameters p;
  const Frame frame = noisyView(Pose(), 3);
  auto map = SurfelMap::create(device, p);
  ASSERT_TRUE(map && map->fuse(kCamera, frame.colour, frame.depth, Pose(), 0, 1));
  const auto surfels = map->download();
  ASSERT_TRUE(surfels && surfels->size() > 500);
  for (const bool both_sides : {false, true}) {
    // Seen from the front, or from the side where some are seen from behind.
    const Pose T_map_cam = both_sides ? Pose(Eigen::Quaterniond(Eigen::AngleAxisd(1.2, Eigen::Vector3d::UnitY())),
                                             Eigen::Vector3d(-1.5, 0, 1.0))
                                      : viewPose(2);
    const PredictionOptions options{0.3f, 20, both_sides};
    const auto found = map->predict(small, T_map_cam, options);
    ASSERT_TRUE(found);
    const PredictedView expected = reference::predict(reference::View(small, T_map_cam, p), *surfels, options);
    size_t differ = 0, filled = 0;
    for (size_t i = 0; i < expected.depth_m.size(); ++i) {
      filled += expected.depth_m.data()[i] > 0;
      const bool same = std::abs(found->depth_m.data()[i] - expected.depth_m.data()[i]) < 1e-3f &&
                        (found->normal.data()[i] - expected.normal.data()[i]).norm() < 1e-3f &&
                        found->colour.data()[i] == expected.colour.data()[i] &&
                        std::abs(found->confidence.data()[i] - expected.confidence.data()[i]) < 1e-4f &&
                        found->contributors.data()[i] == expected.contributors.data()[i];
      differ += !same;
    }
    EXPECT_GT(filled, expected.depth_m.size() / 10);
    EXPECT_LE(differ, filled / 50 + 5) << "both sides " << both_sides;
  }
}

// Of more surfels than keys can number, the same is shown as if they could.
TEST(Prediction, GroupsOfChunksShowTheSameToTheBit) {
  COMAP_DEVICE_OR_SKIP(device);
  gpu::Context& context = device.context();
  const FusionParameters p;
  auto map = SurfelMap::create(device, p);
  ASSERT_TRUE(map);
  for (uint32_t k = 0; k < 3; ++k) {  // the same surface thrice: who was first counts where distances are equal
    const Frame frame = noisyView(viewPose(static_cast<int>(k)), 20 + k);
    ASSERT_TRUE(map->fuse(kCamera, frame.colour, frame.depth, viewPose(static_cast<int>(k)), k, 1));
  }
  auto surfels = *map->download();
  const size_t single = surfels.size();
  surfels.insert(surfels.end(), surfels.begin(), surfels.end());
  for (size_t i = single; i < surfels.size(); ++i) surfels[i].contributors = 2;
  const auto kernels = SurfelKernels::create(context);
  std::vector<SurfelStreams> streams;
  std::vector<ChunkRows> chunks;
  constexpr size_t kChunks = 5;
  for (size_t i = 0; i < kChunks; ++i) {
    const size_t first = surfels.size() * i / kChunks, end = surfels.size() * (i + 1) / kChunks;
    auto made = SurfelStreams::create(context, end - first);
    ASSERT_TRUE(made && writeRows(*made, pack(std::span(surfels).subspan(first, end - first)), 0));
    streams.push_back(std::move(*made));
    chunks.push_back({nullptr, static_cast<uint32_t>(end - first)});
  }
  for (size_t i = 0; i < kChunks; ++i) chunks[i].streams = &streams[i];
  const FramePush frame = framePush(kCamera, viewPose(1), p);
  PredictionBuffers buffers;
  const auto whole = predictView(context, *kernels, chunks, buffers, frame, kCamera, {}, nullptr);
  ASSERT_TRUE(whole);
  size_t filled = 0;
  for (size_t i = 0; i < whole->depth_m.size(); ++i) {
    filled += whole->depth_m.data()[i] > 0;
    EXPECT_NE(whole->contributors.data()[i], 2u) << "pixel " << i << ": the older of two equal ones is shown";
  }
  EXPECT_GT(filled, whole->depth_m.size() * 9 / 10);
  for (const size_t chunks_a_group : {1, 2}) {
    buffers.group_surfels = chunks_a_group * chunks.back().count + 1;
    const auto parts = predictView(context, *kernels, chunks, buffers, frame, kCamera, {}, nullptr);
    ASSERT_TRUE(parts);
    EXPECT_EQ(parts->depth_m, whole->depth_m);
    EXPECT_EQ(parts->normal, whole->normal);
    EXPECT_EQ(parts->colour, whole->colour);
    EXPECT_EQ(parts->confidence, whole->confidence);
    EXPECT_EQ(parts->contributors, whole->contributors);
  }
}

TEST(Blend, MatchesOracle) {
  COMAP_DEVICE_OR_SKIP(device);
  const CameraModel small{65.6, 65.6, 39.5, 29.5, 80, 60};
  const FusionParameters p;
  auto map = SurfelMap::create(device, p);
  ASSERT_TRUE(map);
  for (uint32_t k = 0; k < 2; ++k) {  // so that confidences differ
    const Frame frame = noisyView(viewPose(static_cast<int>(k)), 3 + k);
    ASSERT_TRUE(map->fuse(kCamera, frame.colour, frame.depth, viewPose(static_cast<int>(k)), k, 1));
  }
  const auto surfels = map->download();
  PredictionOptions options{0.3f, 20, true};
  options.blend = true;
  const auto found = map->predict(small, viewPose(2), options);
  ASSERT_TRUE(surfels && found);
  const reference::Blend expected = reference::blend(reference::View(small, viewPose(2), p), *surfels, options);
  size_t differ = 0, filled = 0;
  for (size_t i = 0; i < expected.confidence.size(); ++i) {
    if (!(expected.confidence.data()[i] > 0)) continue;
    ++filled;
    const Rgb c = found->colour.data()[i];
    differ += std::abs(found->confidence.data()[i] - expected.confidence.data()[i]) > 0.05f ||
              (Eigen::Vector3f(c.r, c.g, c.b) - expected.colour.data()[i]).cwiseAbs().maxCoeff() > 1.5f;
  }
  EXPECT_GT(filled, expected.confidence.size() / 2);
  EXPECT_LE(differ, filled / 50 + 5);
}

}  // namespace
}  // namespace comap
