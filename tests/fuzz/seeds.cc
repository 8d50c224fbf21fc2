// fuzz_seeds DIR: what each fuzz program starts from, DIR/TARGET/NAME, made by the product's own writers.
#include <zlib.h>

#include "comap/v1/common.pb.h"
#include "edge_agent/agent_config.h"
#include "edge_agent/capture/image_codec.h"
#include "edge_agent/capture/image_file.h"
#include "fleet_tools/export/ply.h"
#include "fleet_tools/keys/keys_folder.h"
#include "mapping_core/service/core_config.h"
#include "mapping_core/store/tile_bytes.h"
#include "protocol/codec/fern_code_codec.h"
#include "protocol/discovery/note.h"
#include "protocol/link/octets_type.h"
#include "robot_api/wire.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/sample_files.h"
#include "tests/protocol/codec/samples.h"
#include "tests/protocol/discovery/announcement_message.h"

namespace comap::fuzz {
namespace {

class Seeds {
 public:
  explicit Seeds(std::string folder) : folder_(std::move(folder)) {}
  void add(const std::string& target, const std::string& name, Bytes bytes) const {
    std::filesystem::create_directories(folder_ + "/" + target);
    std::ofstream(folder_ + "/" + target + "/" + name, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), std::ssize(bytes));
  }
  void add(const std::string& target, const std::string& name, const std::vector<uint8_t>& bytes) const {
    add(target, name, Bytes(bytes));
  }
  void add(const std::string& target, const std::string& name, const std::string& text) const {
    add(target, name, bytesOf(text));
  }
  void add(const std::string& target, const std::string& name, const Result<std::vector<uint8_t>>& bytes) const {
    require(bool(bytes), "a seed can be encoded");
    add(target, name, Bytes(*bytes));
  }

 private:
  std::string folder_;
};

std::vector<uint8_t> after(std::initializer_list<uint8_t> head, Bytes bytes) {
  std::vector<uint8_t> all(head);
  all.insert(all.end(), bytes.begin(), bytes.end());
  return all;
}

void addMessages(const Seeds& seeds) {
  samples::Random random(3);
  Hello hello;
  hello.robot = "a";
  hello.session = 7;
  hello.fern_book_hash = 9;
  seeds.add("hello", "1", encodeHello(hello));
  Acknowledgement ack;
  ack.robot = "a";
  ack.session = 7;
  ack.next_expected = 4;
  ack.also_held = {6, 7, 9};
  ack.mapped_below = 3;
  seeds.add("acknowledgement", "1", encodeAcknowledgement(ack));
  ack.refusal = "fern book differs";
  seeds.add("acknowledgement", "2", encodeAcknowledgement(ack));
  Correction correction;
  correction.robot = "a";
  correction.session = 7;
  correction.map = "a-7-0";
  correction.revision = 2;
  correction.T_map_odom = samples::pose(random);
  seeds.add("correction", "1", encodeCorrection(correction));
  Interest interest;
  interest.robot = "a";
  interest.session = 7;
  interest.radius_m = 10;
  interest.budget_bytes_per_s = 100000;
  for (int z : {3, 4}) interest.held.push_back({{"a-7-0", 1, -2, z}, 5});
  seeds.add("interest", "1", encodeInterest(interest));
  Status status;
  status.robot = "a";
  status.session = 7;
  seeds.add("status", "1", encodeStatus(status));
  status.refused = {{7, 5, {true, 3, samples::pose(random), Matrix6d::Identity()}}, {6, 0}};
  seeds.add("status", "2", encodeStatus(status));
  CoreStatus core;
  core.keyframes = 12;
  core.maps = 2;
  core.device = "llvmpipe";
  seeds.add("core_status", "1", encodeCoreStatus(core));
  MatchVerdict verdict;
  verdict.query = {"b", 7, 4};
  verdict.candidate = {"a", 7, 1};
  verdict.reason = "round_trip";
  verdict.T_candidate_query = samples::pose(random);
  verdict.information = samples::information(random);
  seeds.add("match_verdict", "1", encodeMatchVerdict(verdict));
  MergeRecord merge;
  merge.number = 1;
  merge.kept = "a-7-0";
  merge.absorbed = "b-7-0";
  merge.robots = {"a", "b"};
  merge.voters = {{"b", 7, 3}, {"b", 7, 4}};
  seeds.add("merge_record", "1", encodeMergeRecord(merge));
  seeds.add("tile", "1", encodeTile(samples::tile(random, 20)));
  seeds.add("tile", "2", encodeTile(samples::tile(random, 0)));
  int number = 0;
  for (const Keyframe& keyframe : sampleKeyframes("a")) {
    const auto message = sampleMessage(keyframe);
    seeds.add("keyframe", std::to_string(++number), Bytes(message));
    seeds.add("depth", std::to_string(number), after({8, 6}, *encodeDepth(keyframe.depth)));
    seeds.add("colour", std::to_string(number), after({8, 6}, *encodeColour(keyframe.colour)));
    v1::FernCode code;
    require(bool(codec::write(keyframe.fern_code, &code, "code")), "a code can be written");
    seeds.add("fern_code", std::to_string(number), code.SerializeAsString());
  }
  OctetsType type;
  Octets octets{"r1", {0xaa, 0xbb}, false};
  eprosima::fastrtps::rtps::SerializedPayload_t payload(type.getSerializedSizeProvider(&octets)());
  require(type.serialize(&octets, &payload), "a sample can be written");
  seeds.add("octets", "1", Bytes(payload.data, payload.length));
}

// A core and a robot that come, say so again, and leave; somebody asks.
void addDiscovery(const Seeds& seeds) {
  std::vector<uint8_t> all;
  const auto say = [&](uint8_t who, NoteKind kind) {
    Note note;
    note.kind = kind;
    note.role = who == 1 ? MemberRole::kCore : MemberRole::kRobot;
    note.site = siteCode(42, "flat");
    ParticipantPrefix prefix;
    prefix.fill(who);
    if (kind == NoteKind::kAnnounce)
      note.announcement = AnnouncementMessage(prefix)
                              .locator(AnnouncementMessage::kMetatrafficUnicast, AnnouncementMessage::kUdp4, 7410)
                              .end();
    const auto bytes = encodeNote(note);
    seeds.add("discovery", "note-" + std::to_string(static_cast<int>(kind)), Bytes(bytes));
    all.insert(all.end(), {who, 25, static_cast<uint8_t>(bytes.size()), static_cast<uint8_t>(bytes.size() >> 8)});
    all.insert(all.end(), bytes.begin(), bytes.end());
    if (kind == NoteKind::kAnnounce) seeds.add("discovery", "announcement", Bytes(note.announcement));
  };
  for (int round = 0; round < 4; ++round)
    for (const uint8_t who : std::initializer_list<uint8_t>{1, 2, 3}) say(who, NoteKind::kAnnounce);
  say(4, NoteKind::kAsk);
  for (const uint8_t who : std::initializer_list<uint8_t>{2, 2, 1}) say(who, NoteKind::kLeave);
  say(2, NoteKind::kAnnounce);
  seeds.add("discovery", "site", Bytes(all));
}

void addFiles(const Seeds& seeds) {
  const MemoryFolder folder;
  const Keyframe keyframe = sampleKeyframes("a").front();
  seeds.add("robot_config", "1", printAgentConfig({}));
  seeds.add("core_config", "1", printCoreConfig({}));
  seeds.add("tum_calibration", "1", std::string("# fx fy cx cy w h scale\n525 -525 319.5 239.5 640 480 5000\n"));
  seeds.add("tum_lists", "associations",
            std::string("\0001.00 rgb/1.png 1.01 depth/1.png\n2.0 rgb/2.png 2.0 d/2.png\n", 56));
  seeds.add("tum_lists", "two",
            std::string("\001# rgb\n1.0 rgb/1.png\n2.0 rgb/2.png\n\xff") + "1.01 depth/1.png\n2 d/2.png\n");
  seeds.add("trajectory", "1", std::string("# t\n1.5 0 1 2 0 0 0 1\n2.5 0 1e-3 2 0 0.7071068 0 0.7071068\n"));
  seeds.add("round_times", "1",
            std::string("tick,camera,track_ms,loop_ms,fuse_ms,predict_ms,ferns_ms,inter_map_ms,total_ms,maps,surfels,"
                        "local_loop,global_loop,merged,lost,loop_points,loop_nodes\n"
                        "1,a,1,2,3,4,5,6,21.00,2,500,0,0,0,0,0,0\n"
                        "1,b,1,2,3,4,5,6,21.50,2,500,0,1,0,0,60,9\n2,a,1,2,3,4,5,6,22.00,1,500,1,0,1,0,533,0\n"));
  const MapPoint points[] = {{{1, 2, 3}, {0, 0, 1}, {1, 2, 3}, 0.1f, 5}, {{1, 2, 4}, {0, 1, 0}, {1, 2, 3}, 0.1f, 5}};
  require(bool(writePly(folder / "map.ply", points)), "a PLY can be written");
  seeds.add("ply", "binary", readFile(folder / "map.ply"));
  seeds.add(
      "ply", "ascii",
      std::string("ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty double y\nproperty float z\n"
                  "property char nx\nproperty char ny\nproperty char nz\nproperty float radius\nend_header\n"
                  "1 2 3 0 0 127 0.1\n1 2 4 0 127 0 0.1\n"));
  seeds.add("ply", "list",
            std::string("ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                        "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n") +
                std::string(12, '\0'));
  require(writeColourPng(folder / "c.png", keyframe.colour) && writeColourJpeg(folder / "c.jpg", keyframe.colour, 80) &&
              writeDepth16Png(folder / "d.png", keyframe.depth),
          "pictures can be written");
  for (const char* name : {"c.png", "c.jpg", "d.png"}) seeds.add("picture_file", name, readFile(folder / name));
  const std::string jpeg = readFile(folder / "c.jpg");
  seeds.add("camera_picture", "MJPG", after({0, 16, 12, 0, 0, 0}, bytesOf(jpeg)));
  const std::vector<uint8_t> grey(16 * 12 * 4, 100);
  for (uint8_t format = 1; format < 8; ++format)
    seeds.add("camera_picture", std::to_string(format), after({format, 8, 6, 64, 0, 0}, grey));
  samples::Random random(4);
  const Tile tile = samples::tile(random, 30);
  seeds.add("tile_bytes", "1", after({30, 0, 0}, compressSurfels(tile.surfels)));
  const auto said = [&](uint8_t kind, const std::string& frame) {
    seeds.add("robot_wire", std::to_string(kind), after({kind}, bytesOf(frame.substr(robot_api::kHeaderBytes))));
  };
  said(1, robot_api::encode(robot_api::Greeting{}));
  said(2, robot_api::encode(robot_api::PoseNews{}));
  said(4, robot_api::encode(robot_api::SurfelsHead{1, 2, 30, "m"}));
  said(5, robot_api::encode(tile));
  said(7, robot_api::encode(robot_api::Refusal{robot_api::kBadData, "no"}));
  said(16, robot_api::encode(robot_api::AskPose{3, 100}));
  said(17, robot_api::encode(robot_api::AskSurfels{{-1, -1, -1}, {1, 1, 1}, 0, 100}));
  std::string klg;
  const auto put = [&](const auto& value) { klg.append(reinterpret_cast<const char*>(&value), sizeof value); };
  put(int32_t{2});
  for (int64_t stamp : {1000000, 1033333}) {
    std::string packed(compressBound(2 * keyframe.depth.size()), 0);
    uLongf size = packed.size();
    compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(keyframe.depth.data()),
             2 * keyframe.depth.size());
    put(stamp);
    put(static_cast<int32_t>(size));
    put(static_cast<int32_t>(jpeg.size()));
    klg += packed.substr(0, size) + jpeg;
  }
  seeds.add("klg", "1", klg);
}

void addKeys(const Seeds& seeds) {
  const MemoryFolder folder;
  const std::time_t now = std::time(nullptr);
  const Validity validity{now - 60, now + 86400};
  require(makeKeysFolder(folder / "keys", "flat", validity) &&
              addParticipant(folder / "keys", KeyRole::kRobot, "a", validity),
          "keys can be made");
  const Credentials own = credentialsIn(folder / "keys/a");
  uint8_t number = 0;
  for (const std::string& path :
       {own.authority, own.certificate, own.key, own.governance, own.permissions, own.revoked}) {
    seeds.add("keys", std::to_string(number) + "-whole", after({number, 0}, bytesOf(readFile(path))));
    seeds.add("keys", std::to_string(number) + "-edit", after({number, 1, 0, 80, 65}, {}));
    ++number;
  }
}

void addRows(const Seeds& seeds) {
  samples::Random random(6);
  for (const char* target : {"store_rows", "outbox", "store_file", "tile_store"}) {
    for (int i = 0; i < 20; ++i) {
      std::vector<uint8_t> bytes(static_cast<size_t>(samples::uniform(random, 4, 200)));
      for (uint8_t& byte : bytes) byte = static_cast<uint8_t>(random());
      seeds.add(target, std::to_string(i), Bytes(bytes));
    }
  }
  // Whole messages, which then change inside a row.
  const auto message = sampleMessage(sampleKeyframes("b").front());
  for (const char* target : {"store_rows", "outbox"}) seeds.add(target, "message", Bytes(message));
}

}  // namespace
}  // namespace comap::fuzz

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: fuzz_seeds DIR\n");
    return 2;
  }
  const comap::fuzz::Seeds seeds(argv[1]);
  comap::fuzz::addMessages(seeds);
  comap::fuzz::addDiscovery(seeds);
  comap::fuzz::addFiles(seeds);
  comap::fuzz::addKeys(seeds);
  comap::fuzz::addRows(seeds);
  return 0;
}
