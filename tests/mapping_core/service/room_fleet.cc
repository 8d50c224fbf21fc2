#include "tests/mapping_core/service/room_fleet.h"

#include <random>

#include "mapping_core/ferns/fern_encoder.h"
#include "mapping_core/tiles/tile_builder.h"
#include "protocol/codec/keyframe_codec.h"
#include "tests/scenes/scene.h"

namespace comap {
namespace {

Pose T_world_cam(char robot, uint32_t sequence) {
  const int r = robot - 'a';
  const double yaw = 0.15 * sequence + 0.07 * r;
  return Pose(Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY())),
              Eigen::Vector3d(0.05 * sequence - 0.08 * r, 0.03 * r, 0.04 * r));
}

}  // namespace

Keyframe roomKeyframe(char robot, uint32_t sequence) {
  static const Scene scene = Scene::room();
  static const FernBook book = FernBook::standard();
  const Frame frame = scene.render(smallCamera(), T_world_cam(robot, sequence), 1000 + sequence);
  Keyframe keyframe;
  keyframe.id = {std::string(1, robot), 1, sequence};
  keyframe.stamp_ns = frame.stamp_ns;
  keyframe.camera = frame.camera;
  keyframe.colour = frame.colour;
  keyframe.depth = frame.depth;
  keyframe.fern_code = encodeFerns(book, frame.colour, frame.depth);
  keyframe.T_odom_cam = T_world_cam(robot, 0).inverse() * T_world_cam(robot, sequence);
  if (sequence == 0) return keyframe;
  std::mt19937 engine(static_cast<uint32_t>(robot) * 1000 + sequence);
  std::normal_distribution<double> noise(0, 0.001);
  Vector6d error;
  for (int i = 0; i < 6; ++i) error(i) = noise(engine);
  keyframe.linked = true;
  keyframe.linked_to = sequence - 1;
  keyframe.T_link_this = T_world_cam(robot, sequence - 1).inverse() * T_world_cam(robot, sequence) * Pose::exp(error);
  keyframe.information = Matrix6d::Identity() * 1e5;
  keyframe.inlier_ratio = 0.95;
  return keyframe;
}

MapBuilderOptions roomOptions() {
  MapBuilderOptions options;
  options.loop_gap = 2;
  options.live_ties = 0;  // they depend on where the map had a pair, so on what it was joined with
  options.fusion.initial_capacity = 1 << 18;
  return options;
}

void keep(MapStore& store, const Keyframe& keyframe) {
  const auto encoded = encodeKeyframe(keyframe);
  ASSERT_TRUE(encoded) << encoded.error().text;
  const auto added = store.addKeyframe(keyframe.id, keyframe.stamp_ns, *encoded);
  ASSERT_TRUE(added) << added.error().text;
}

std::vector<MergeRecord> mapTurns(MapBuilder& builder, MapStore& store, const std::string& robots, uint32_t first,
                                  uint32_t last) {
  std::vector<MergeRecord> merges;
  for (uint32_t i = first; i < last; ++i)
    for (const char robot : robots) {
      const Keyframe keyframe = roomKeyframe(robot, i);
      keep(store, keyframe);
      const auto encoded = store.encodedKeyframe(keyframe.id);
      const auto change = builder.addKeyframe(*decodeKeyframe(*encoded), static_cast<uint32_t>(robot - 'a'));
      EXPECT_TRUE(change) << change.error().text;
      if (change) merges.insert(merges.end(), change->merges.begin(), change->merges.end());
    }
  return merges;
}

MapHashes finish(MapBuilder& builder) {
  const auto settled = builder.settle();
  EXPECT_TRUE(settled) << settled.error().text;
  const auto rebuilt = builder.rebuild({});
  EXPECT_TRUE(rebuilt) << rebuilt.error().text;
  return hashesOf(builder);
}

MapHashes hashesOf(MapBuilder& builder) {
  MapHashes hashes;
  for (const KeyframeId& anchor : builder.components().anchors()) {
    const auto surfels = builder.surfels(anchor).download();
    EXPECT_TRUE(surfels) << surfels.error().text;
    if (surfels) hashes[mapIdOf(anchor)] = hashTiles(buildTiles(mapIdOf(anchor), *surfels, {}));
  }
  return hashes;
}

}  // namespace comap
