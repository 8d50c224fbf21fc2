#include "tests/fuzz/sample_files.h"

#include "edge_agent/map_cache/tile_store.h"
#include "edge_agent/uplink/outbox.h"
#include "mapping_core/store/map_store.h"
#include "protocol/codec/codec.h"
#include "tests/fuzz/fuzz.h"
#include "tests/protocol/codec/samples.h"

namespace comap::fuzz {

std::vector<Keyframe> sampleKeyframes(const std::string& robot) {
  samples::Random random(robot.size() + static_cast<size_t>(robot.front()));
  std::vector<Keyframe> keyframes;
  for (uint32_t i = 0; i < 3; ++i) {
    Keyframe& keyframe = keyframes.emplace_back(samples::keyframe(random, 32, 24));
    keyframe.id = {robot, kSampleSession, i};
    keyframe.skipped = 0;
    keyframe.linked = i > 0;
    keyframe.linked_to = i > 0 ? i - 1 : 0;
  }
  return keyframes;
}

std::vector<uint8_t> sampleMessage(const Keyframe& keyframe) {
  auto message = encodeKeyframe(keyframe);
  require(bool(message), "a sample keyframe can be encoded");
  return *message;
}

std::string writeSampleStore(const std::string& path) {
  auto store = MapStore::open(path, MapStore::Mode::kCreateOrOpen);
  require(bool(store), "a store can be made");
  samples::Random random(5);
  std::vector<KeyframeId> ids;
  for (const char* robot : {"a", "b"}) {
    for (const Keyframe& keyframe : sampleKeyframes(robot)) {
      require(bool(store->addKeyframe(keyframe.id, keyframe.stamp_ns, sampleMessage(keyframe))), "keyframe");
      require(bool(store->setPoses("a-7-0", {{keyframe.id, samples::pose(random)}})), "pose");
      if (keyframe.linked)
        require(bool(store->addEdge(
                    {ids.back(), keyframe.id, EdgeKind::kOdometry, keyframe.T_link_this, keyframe.information})),
                "edge");
      ids.push_back(keyframe.id);
    }
  }
  MatchVerdict verdict;
  verdict.query = ids[4];
  verdict.candidate = ids[1];
  verdict.accepted = true;
  verdict.reason = "accepted";
  verdict.T_candidate_query = samples::pose(random);
  verdict.information = samples::information(random);
  MergeRecord merge;
  merge.number = 1;
  merge.kept = "a-7-0";
  merge.absorbed = "b-7-0";
  merge.robots = {"a", "b"};
  merge.voters = {ids[3], ids[4]};
  merge.keyframes_ingested = 6;
  const Edge closure{ids[1], ids[4], EdgeKind::kInterRobot, verdict.T_candidate_query, verdict.information};
  const Tile tiles[] = {samples::tile(random, 40), samples::tile(random, 9)};
  require(store->addVerdict(verdict) && store->addMerge(merge) && store->addEdge(closure) && store->setTiles(tiles) &&
              store->setMeta("complete", "yes"),
          "a store can be filled");
  return path;
}

std::string writeSampleOutbox(const std::string& path) {
  auto outbox = Outbox::open(path);
  require(outbox && outbox->beginSession(kSampleSession), "an outbox can be made");
  for (const Keyframe& keyframe : sampleKeyframes("a")) {
    OutboxRow row;
    row.key = {keyframe.id.session, keyframe.id.sequence};
    row.T_odom_cam = keyframe.T_odom_cam;
    row.link = {keyframe.linked, keyframe.linked_to, keyframe.T_link_this, keyframe.information};
    require(bool(outbox->add(row, sampleMessage(keyframe))), "an outbox can be filled");
  }
  return path;
}

Tile sampleTile(const MapId& map, int x) {
  samples::Random random(static_cast<unsigned>(x) + 40);
  Tile tile = samples::tile(random, 12);
  tile.key = {map, x, 0, 0};
  return tile;
}

std::string writeSampleTileStore(const std::string& path) {
  auto store = TileStore::open(path, 1 << 20);
  require(bool(store), "a store of tiles can be made");
  for (const char* map : {"m", "n"}) {
    std::vector<TileStore::Change> changes;
    for (int x = 0; x < 3; ++x) {
      const Tile tile = sampleTile(map, x);
      changes.push_back({tile.key, tile.revision, *encodeTile(tile)});
    }
    require(bool(store->write(map, changes, Eigen::Vector3d::Zero())) && bool(store->revisions(map)),
            "a store of tiles can be filled");
  }
  return path;
}

std::string readFile(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace comap::fuzz
