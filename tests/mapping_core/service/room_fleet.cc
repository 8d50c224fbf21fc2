#include "tests/mapping_core/service/room_fleet.h"

#include <algorithm>
#include <random>

#include "mapping_core/ferns/fern_encoder.h"
#include "mapping_core/tiles/tile_builder.h"
#include "protocol/codec/keyframe_codec.h"
#include "tests/scenes/scene.h"

namespace comap {
namespace {

bool elsewhere(char robot) { return robot >= 'x'; }

}  // namespace

Pose roomPose(char robot, uint32_t sequence) {
  const int r = elsewhere(robot) ? robot - 'w' : robot - 'a';
  const double yaw = 0.15 * sequence + 0.07 * r;
  return Pose(Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitY())),
              Eigen::Vector3d(0.05 * sequence - 0.08 * r, 0.03 * r, 0.04 * r));
}

Keyframe roomKeyframe(char robot, uint32_t sequence) {
  static const Scene room = Scene::room(), other_room = Scene::room(2);
  const Scene& scene = elsewhere(robot) ? other_room : room;
  static const FernBook book = FernBook::standard();
  const Frame frame = scene.render(smallCamera(), roomPose(robot, sequence), 1000 + sequence);
  Keyframe keyframe;
  keyframe.id = {std::string(1, robot), 1, sequence};
  keyframe.stamp_ns = frame.stamp_ns;
  keyframe.camera = frame.camera;
  keyframe.colour = frame.colour;
  keyframe.depth = frame.depth;
  keyframe.fern_code = encodeFerns(book, frame.colour, frame.depth);
  keyframe.T_odom_cam = roomPose(robot, 0).inverse() * roomPose(robot, sequence);
  if (sequence == 0) return keyframe;
  std::mt19937 engine(static_cast<uint32_t>(robot) * 1000 + sequence);
  std::normal_distribution<double> noise(0, 0.001);
  Vector6d error;
  for (int i = 0; i < 6; ++i) error(i) = noise(engine);
  keyframe.linked = true;
  keyframe.linked_to = sequence - 1;
  keyframe.T_link_this = roomPose(robot, sequence - 1).inverse() * roomPose(robot, sequence) * Pose::exp(error);
  keyframe.information = Matrix6d::Identity() * 1e5;
  keyframe.inlier_ratio = 0.95;
  return keyframe;
}

MapBuilderOptions roomOptions() {
  MapBuilderOptions options;
  options.search.loop_gap = 2;
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

MapChange mapAll(MapBuilder& builder, MapStore& store, const std::string& robots, uint32_t first, uint32_t last) {
  MapChange all;
  const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
  for (uint32_t i = first; i < last; ++i)
    for (const char robot : robots) {
      const Keyframe keyframe = roomKeyframe(robot, i);
      keep(store, keyframe);
      const auto encoded = store.encodedKeyframe(keyframe.id);
      const auto known = *store.robots();
      const auto index = std::find(known.begin(), known.end(), keyframe.id.robot) - known.begin();
      const auto change = builder.addKeyframe(*decodeKeyframe(*encoded), static_cast<uint32_t>(index));
      EXPECT_TRUE(change) << change.error().text;
      if (!change) return all;
      append(all.verdicts, change->verdicts);
      append(all.merges, change->merges);
      append(all.undone, change->undone);
      append(all.confirmed, change->confirmed);
    }
  return all;
}

std::vector<MergeRecord> mapTurns(MapBuilder& builder, MapStore& store, const std::string& robots, uint32_t first,
                                  uint32_t last) {
  return mapAll(builder, store, robots, first, last).merges;
}

MapHashes finish(MapBuilder& builder) {
  const auto settled = builder.settle();
  EXPECT_TRUE(settled) << settled.error().text;
  const auto rebuilt = builder.rebuild({});
  EXPECT_TRUE(rebuilt) << rebuilt.error().text;
  return hashesOf(builder);
}

void forgeMatch(MapStore& store, char a, char b, uint32_t sequence, const Pose& error, double information) {
  MatchVerdict verdict;
  verdict.query = {std::string(1, b), 1, sequence};
  verdict.candidate = {std::string(1, a), 1, sequence};
  verdict.accepted = true;
  verdict.reason = "accepted";
  verdict.T_candidate_query = roomPose(a, sequence).inverse() * error * roomPose(b, sequence);
  verdict.information = Matrix6d::Identity() * information;
  ASSERT_TRUE(store.addVerdict(verdict));
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
