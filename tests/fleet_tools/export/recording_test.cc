// A store as an MCAP file, read back by a reader of its own: records, chunks, indexes, checksums, and messages by the
// schemas that the file itself carries.
#include "fleet_tools/export/recording.h"

#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/dynamic_message.h>
#include <gtest/gtest.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <fstream>
#include <set>

#include "fleet_tools/export/mcap_writer.h"
#include "mapping_core/tiles/tile_builder.h"
#include "protocol/codec/colour_codec.h"
#include "protocol/codec/keyframe_codec.h"
#include "tests/files/temporary_folder.h"

namespace comap {
namespace {

namespace pb = google::protobuf;

uint64_t numberAt(const std::string& bytes, size_t at, int size) {
  uint64_t value = 0;
  for (int i = 0; i < size; ++i) value |= uint64_t{static_cast<uint8_t>(bytes.at(at + size_t(i)))} << 8 * i;
  return value;
}

// Reads from left to right.
struct Cursor {
  const std::string& bytes;
  size_t at = 0;
  uint64_t number(int size) {
    at += size_t(size);
    return numberAt(bytes, at - size_t(size), size);
  }
  std::string take(size_t size) {
    if (at + size > bytes.size()) throw std::out_of_range("record ends early");
    at += size;
    return bytes.substr(at - size, size);
  }
  std::string text() { return take(number(4)); }
  bool done() const { return at >= bytes.size(); }
};

struct Record {
  int opcode;
  std::string content;
  size_t at;
};

std::vector<Record> recordsOf(const std::string& bytes, size_t begin, size_t end) {
  std::vector<Record> records;
  const std::string part = bytes.substr(0, end);
  for (Cursor cursor{part, begin}; !cursor.done();) {
    const size_t at = cursor.at;
    const int opcode = static_cast<int>(cursor.number(1));
    records.push_back({opcode, cursor.take(cursor.number(8)), at});
  }
  return records;
}

uint32_t crc(const std::string& bytes) {
  return uint32_t(crc32_z(0, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()));
}

struct Message {
  std::string topic, schema, data;
  uint64_t time_ns;
};

// Checks what can be checked on the way; messages in the order of the file.
struct McapFile {
  std::map<uint64_t, std::pair<std::string, std::string>> schemas;  // number -> name, descriptors
  std::map<uint64_t, std::pair<uint64_t, std::string>> channels;    // number -> schema, topic
  std::vector<Message> messages;
  size_t chunks = 0;

  void define(const Record& record) {
    Cursor c{record.content};
    const uint64_t number = c.number(2);
    if (record.opcode == 3) {
      const std::string name = c.text();
      EXPECT_EQ(c.text(), "protobuf");
      schemas[number] = {name, c.text()};
    } else {
      const uint64_t schema = c.number(2);
      const std::string topic = c.text();
      EXPECT_EQ(c.text(), "protobuf");
      EXPECT_EQ(c.number(4), 0u);
      EXPECT_TRUE(schemas.contains(schema));
      channels[number] = {schema, topic};
    }
    EXPECT_TRUE(c.done());
  }

  // The chunk's messages by their places in it.
  std::map<uint64_t, uint64_t> readChunk(const Record& record) {
    Cursor c{record.content};
    const uint64_t first = c.number(8), last = c.number(8), size = c.number(8), sum = c.number(4);
    EXPECT_EQ(c.text(), "zstd");
    const std::string packed = c.take(c.number(8));
    std::string raw(size, '\0');
    EXPECT_EQ(ZSTD_decompress(raw.data(), raw.size(), packed.data(), packed.size()), size);
    EXPECT_EQ(crc(raw), sum);
    std::map<uint64_t, uint64_t> times;
    for (const Record& one : recordsOf(raw, 0, raw.size())) {
      if (one.opcode != 5) {
        define(one);
        continue;
      }
      Cursor m{one.content};
      const uint64_t channel = m.number(2);
      m.number(4);
      const uint64_t time_ns = m.number(8);
      EXPECT_EQ(m.number(8), time_ns);
      EXPECT_TRUE(channels.contains(channel)) << "told before it is used, in the data itself";
      EXPECT_GE(time_ns, first);
      EXPECT_LE(time_ns, last);
      times[one.at] = time_ns;
      messages.push_back(
          {channels[channel].second, schemas[channels[channel].first].first, one.content.substr(m.at), time_ns});
    }
    ++chunks;
    return times;
  }

  explicit McapFile(const std::string& path) { read(path); }

  void read(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(in)), {});
    const std::string magic("\x89MCAP0\r\n", 8);
    ASSERT_GT(bytes.size(), 60u);
    ASSERT_EQ(bytes.substr(0, 8), magic);
    ASSERT_EQ(bytes.substr(bytes.size() - 8), magic);
    const std::vector<Record> records = recordsOf(bytes, 8, bytes.size() - 8);
    ASSERT_EQ(records.front().opcode, 1);
    ASSERT_EQ(records.back().opcode, 2);
    const size_t summary_at = numberAt(records.back().content, 0, 8),
                 offsets_at = numberAt(records.back().content, 8, 8);
    EXPECT_EQ(crc(bytes.substr(summary_at, bytes.size() - 8 - 4 - summary_at)),
              numberAt(records.back().content, 16, 4));
    std::map<uint64_t, uint64_t> in_chunk;
    size_t indexed = 0, data_ends = 0;
    std::map<size_t, int> starts;
    for (const Record& record : records) {
      starts[record.at] = record.opcode;
      if (record.opcode == 6) {
        in_chunk = readChunk(record);
      } else if (record.opcode == 7) {
        Cursor c{record.content};
        c.number(2);
        for (uint64_t left = c.number(4) / 16; left > 0; --left, ++indexed) {
          const uint64_t time_ns = c.number(8);
          EXPECT_EQ(in_chunk.at(c.number(8)), time_ns);
        }
      } else if (record.opcode == 15) {
        EXPECT_LT(record.at, summary_at);
        ++data_ends;
      } else if (record.at >= summary_at && (record.opcode == 3 || record.opcode == 4)) {
        define(record);
      } else if (record.opcode == 8) {
        Cursor c{record.content};
        c.take(16);
        const uint64_t at = c.number(8), length = c.number(8);
        EXPECT_EQ(starts.at(at), 6);
        EXPECT_TRUE(starts.at(at + length) == 7) << "its first message index";
        Cursor places{record.content, c.at};
        for (uint64_t left = places.number(4) / 10; left > 0; --left) {
          places.number(2);
          EXPECT_EQ(starts.at(places.number(8)), 7);
        }
      } else if (record.opcode == 11) {
        EXPECT_EQ(numberAt(record.content, 0, 8), messages.size());
        EXPECT_EQ(numberAt(record.content, 8, 2), schemas.size());
        EXPECT_EQ(numberAt(record.content, 10, 4), channels.size());
        EXPECT_EQ(numberAt(record.content, 22, 4), chunks);
      } else if (record.opcode == 14) {
        EXPECT_GE(record.at, offsets_at);
        EXPECT_EQ(starts.at(numberAt(record.content, 1, 8)), int(numberAt(record.content, 0, 1)));
      }
    }
    EXPECT_EQ(indexed, messages.size());
    EXPECT_EQ(data_ends, 1u);
  }

  std::vector<Message> of(const std::string& topic) const {
    std::vector<Message> some;
    for (const Message& message : messages)
      if (message.topic == topic) some.push_back(message);
    return some;
  }
};

// Decodes by the descriptors in the file, as a program that does not know the types.
class Decoder {
 public:
  explicit Decoder(const McapFile& file) {
    for (const auto& [number, schema] : file.schemas) {
      pb::FileDescriptorSet set;
      EXPECT_TRUE(set.ParseFromString(schema.second));
      for (const pb::FileDescriptorProto& one : set.file()) {
        if (pool_.FindFileByName(one.name()) == nullptr) {
          EXPECT_NE(pool_.BuildFile(one), nullptr) << one.name() << ": in an order that builds";
        }
      }
    }
  }
  std::string text(const Message& message) {
    const pb::Descriptor* type = pool_.FindMessageTypeByName(message.schema);
    if (type == nullptr) return "no type " + message.schema;
    const std::unique_ptr<pb::Message> decoded(factory_.GetPrototype(type)->New());
    return decoded->ParseFromString(message.data) ? decoded->ShortDebugString() : "not a " + message.schema;
  }

 private:
  pb::DescriptorPool pool_;
  pb::DynamicMessageFactory factory_;
};

class Recording : public ::testing::Test {
 protected:
  static KeyframeId idOf(const std::string& robot, uint32_t sequence) { return {robot, 5, sequence}; }
  static constexpr int64_t kStart_ns = 1'700'000'000'500'000'000;

  void fill(uint32_t keyframes) {
    auto store = MapStore::open(store_, MapStore::Mode::kCreateOrOpen);
    ASSERT_TRUE(store);
    std::vector<Tile> tiles;
    for (const std::string robot : {"alpha", "bravo"})
      for (uint32_t i = 0; i < keyframes; ++i) {
        Keyframe keyframe;
        keyframe.id = idOf(robot, i);
        keyframe.stamp_ns = kStart_ns + int64_t(i) * 1'000'000'000;
        keyframe.camera = {60, 61, 31.5, 23.5, 64, 48};
        keyframe.colour = ColourImage(64, 48, Rgb{200, uint8_t(i), 30});
        keyframe.depth = DepthImage(64, 48, 2000);
        const auto encoded = encodeKeyframe(keyframe);
        ASSERT_TRUE(encoded) << encoded.error().text;
        ASSERT_TRUE(*store->addKeyframe(keyframe.id, keyframe.stamp_ns, *encoded));
        const Pose pose(Eigen::Quaterniond::Identity(), {0.5 * i, robot == "alpha" ? 0.0 : 1.0, 0});
        ASSERT_TRUE(store->setPoses("alpha-5-0", {{keyframe.id, pose}}));
      }
    Surfel surfel;
    surfel.position = {0.3f, 0.2f, 1.1f};
    surfel.radius = 0.01f;
    surfel.confidence = 7;
    surfel.colour = {10, 20, 30};
    ASSERT_TRUE(store->setTiles(buildTiles("alpha-5-0", std::vector<Surfel>(3, surfel), {})));
    ASSERT_TRUE(store->addMerge({1, "alpha-5-0", "bravo-5-0", {}, {"alpha", "bravo"}, {idOf("bravo", 1)}, 6, {}}));
    MatchVerdict verdict;
    verdict.query = idOf("bravo", 1);
    verdict.candidate = idOf("alpha", 0);
    verdict.accepted = true;
    verdict.reason = "accepted";
    ASSERT_TRUE(store->addVerdict(verdict));
  }
  Result<RecordingCounts> write(const MapId& map = "") {
    const auto store = MapStore::open(store_, MapStore::Mode::kReadOnly);
    EXPECT_TRUE(store);
    return writeRecording(*store, out_, map, {});
  }

  const TemporaryFolder temporary_;
  const std::string store_ = temporary_.path("map.comap"), out_ = temporary_.path("r.mcap");
};

TEST_F(Recording, HoldsWhatTheStoreHolds) {
  fill(3);
  const auto counts = write();
  ASSERT_TRUE(counts) << counts.error().text;
  EXPECT_EQ(counts->poses, 6u);
  EXPECT_EQ(counts->pictures, 6u);
  EXPECT_EQ(counts->points, 3u);
  EXPECT_EQ(counts->events, 2u);
  const McapFile file(out_);
  Decoder decoder(file);
  const auto poses = file.of("/bravo/pose");
  ASSERT_EQ(poses.size(), 3u);
  EXPECT_EQ(poses[2].schema, "foxglove.PoseInFrame");
  EXPECT_EQ(poses[2].time_ns, uint64_t(kStart_ns) + 2'000'000'000);
  EXPECT_EQ(decoder.text(poses[2]),
            "timestamp { seconds: 1700000002 nanos: 500000000 } frame_id: \"alpha-5-0\" pose { position { x: 1 y: 1 } "
            "orientation { w: 1 } }");
  const auto frames = file.of("/tf");
  EXPECT_EQ(frames.size(), 6u);
  EXPECT_TRUE(std::ranges::is_sorted(frames, {}, &Message::time_ns)) << "the robots' frames by turns";
  EXPECT_NE(decoder.text(file.of("/tf")[5]).find("parent_frame_id: \"alpha-5-0\" child_frame_id: \"bravo\""),
            std::string::npos);
  ASSERT_EQ(file.of("/alpha/path").size(), 1u);
  const auto pictures = file.of("/alpha/picture");
  ASSERT_EQ(pictures.size(), 3u);
  const std::string picture = decoder.text(pictures[0]);
  EXPECT_NE(picture.find("format: \"jpeg\" frame_id: \"alpha\""), std::string::npos)
      << picture.substr(picture.size() - 80);
  EXPECT_NE(decoder.text(file.of("/alpha/camera")[0]).find("K: 60 K: 0 K: 31.5 K: 0 K: 61 K: 23.5"), std::string::npos)
      << decoder.text(file.of("/alpha/camera")[0]);
  const auto points = file.of("/alpha-5-0/points");
  ASSERT_EQ(points.size(), 1u);
  EXPECT_EQ(points[0].time_ns, uint64_t(kStart_ns)) << "from the beginning";
  EXPECT_NE(decoder.text(points[0]).find("point_stride: 16 fields { name: \"x\" type: FLOAT32 }"), std::string::npos);
  const auto events = file.of("/events");
  ASSERT_EQ(events.size(), 2u);
  EXPECT_NE(decoder.text(events[0]).find("merge 1: map bravo-5-0 becomes part of alpha-5-0 by 1 vote"),
            std::string::npos);
}

TEST_F(Recording, ManyChunksAreIndexedToo) {
  auto writer = McapWriter::create(out_, "test");
  ASSERT_TRUE(writer);
  pb::FileDescriptorSet set;
  pb::FileDescriptorProto::descriptor()->file()->CopyTo(set.add_file());
  const uint16_t schema = writer->addSchema("google.protobuf.FileOptions", set.SerializeAsString());
  const uint16_t one = writer->addChannel(schema, "one"), two = writer->addChannel(schema, "two");
  pb::FileOptions message;
  for (uint32_t i = 0; i < 5000; ++i) {
    message.set_java_package(std::string(800, char('a' + i % 26)));
    ASSERT_TRUE(writer->write(i % 3 == 0 ? one : two, 1'000'000 - 7 * i % 1000, message.SerializeAsString()));
  }
  ASSERT_TRUE(writer->finish());
  const McapFile file(out_);
  EXPECT_GE(file.chunks, 4u);
  EXPECT_EQ(file.messages.size(), 5000u);
  EXPECT_EQ(file.of("one").size(), 1667u);
  EXPECT_EQ(Decoder(file).text(file.messages[27]), "java_package: \"" + std::string(800, 'b') + "\"");
}

TEST_F(Recording, AnEmptyStoreGivesAnEmptyRecording) {
  ASSERT_TRUE(MapStore::open(store_, MapStore::Mode::kCreateOrOpen));
  ASSERT_TRUE(write());
  EXPECT_TRUE(McapFile(out_).messages.empty());
}

TEST_F(Recording, WhatCannotBeWrittenOrShouldNotBeThereIsSaid) {
  fill(1);
  {
    auto store = MapStore::open(store_, MapStore::Mode::kOpen);
    ASSERT_TRUE(*store->addKeyframe(idOf("alpha", 9), -5, std::vector<uint8_t>(10)));
    ASSERT_TRUE(store->setPoses("alpha-5-0", {{idOf("alpha", 9), Pose()}}));
  }
  const auto refused = write();
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().text, "keyframe alpha/5/9 is of time -5 ns, expected none before 1970");
  EXPECT_EQ(McapWriter::create("/nowhere/at/all.mcap", "test").error().code, ErrorCode::kUnreachable);
}

}  // namespace
}  // namespace comap
