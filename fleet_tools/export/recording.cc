#include "fleet_tools/export/recording.h"

#include <foxglove/scene.pb.h>
#include <google/protobuf/descriptor.pb.h>
#include <google/protobuf/timestamp.pb.h>

#include <algorithm>
#include <cstring>
#include <set>

#include "fleet_tools/command_line/text_table.h"
#include "fleet_tools/export/map_points.h"
#include "fleet_tools/export/mcap_writer.h"
#include "protocol/codec/colour_codec.h"
#include "protocol/codec/keyframe_codec.h"

namespace comap {
namespace {

constexpr int64_t kSecond_ns = 1'000'000'000;
constexpr size_t kMostBytes = 1 << 30;  // of a message; Protobuf ends at 2 GiB

void addFile(const google::protobuf::FileDescriptor& file, google::protobuf::FileDescriptorSet& set,
             std::set<std::string>& known) {
  if (!known.insert(std::string(file.name())).second) return;
  for (int i = 0; i < file.dependency_count(); ++i) addFile(*file.dependency(i), set, known);
  file.CopyTo(set.add_file());
}

// Channels are made as they are first written to.
class Topics {
 public:
  explicit Topics(McapWriter& writer) : writer_(writer) {}

  template <class Message>
  Result<void> write(const std::string& topic, int64_t time_ns, Message& message) {
    message.mutable_timestamp()->set_seconds(time_ns / kSecond_ns);
    message.mutable_timestamp()->set_nanos(static_cast<int32_t>(time_ns % kSecond_ns));
    auto channel = channels_.find(topic);
    if (channel == channels_.end())
      channel = channels_.emplace(topic, writer_.addChannel(schemaOf(*Message::descriptor()), topic)).first;
    return writer_.write(channel->second, static_cast<uint64_t>(time_ns), message.SerializeAsString());
  }

 private:
  uint16_t schemaOf(const google::protobuf::Descriptor& type) {
    const std::string name(type.full_name());
    const auto known = schemas_.find(name);
    if (known != schemas_.end()) return known->second;
    google::protobuf::FileDescriptorSet set;
    std::set<std::string> files;
    addFile(*type.file(), set, files);
    return schemas_[name] = writer_.addSchema(name, set.SerializeAsString());
  }

  McapWriter& writer_;
  std::map<std::string, uint16_t> schemas_, channels_;
};

void fill(const Eigen::Vector3d& from, foxglove::Vector3& to) {
  to.set_x(from.x());
  to.set_y(from.y());
  to.set_z(from.z());
}

void fill(const Eigen::Quaterniond& from, foxglove::Quaternion& to) {
  to.set_x(from.x());
  to.set_y(from.y());
  to.set_z(from.z());
  to.set_w(from.w());
}

void fill(const Pose& from, foxglove::Pose& to) {
  fill(from.translation(), *to.mutable_position());
  fill(from.rotation(), *to.mutable_orientation());
}

Result<void> writePlace(Topics& topics, const StoredKeyframe& keyframe) {
  foxglove::PoseInFrame pose;
  pose.set_frame_id(keyframe.map);
  fill(keyframe.T_map_cam, *pose.mutable_pose());
  if (auto written = topics.write("/" + keyframe.id.robot + "/pose", keyframe.stamp_ns, pose); !written) return written;
  foxglove::FrameTransform frame;
  frame.set_parent_frame_id(keyframe.map);
  frame.set_child_frame_id(keyframe.id.robot);
  fill(keyframe.T_map_cam.translation(), *frame.mutable_translation());
  fill(keyframe.T_map_cam.rotation(), *frame.mutable_rotation());
  return topics.write("/tf", keyframe.stamp_ns, frame);
}

Result<void> writePicture(Topics& topics, const MapStore& store, const StoredKeyframe& stored) {
  const auto encoded = store.encodedKeyframe(stored.id);
  if (!encoded) return encoded.error();
  const auto keyframe = decodeKeyframe(*encoded);
  if (!keyframe) return Error{keyframe.error().code, toString(stored.id) + ": " + keyframe.error().text};
  const auto jpeg = encodeColour(keyframe->colour);
  if (!jpeg) return jpeg.error();
  foxglove::CompressedImage picture;
  picture.set_frame_id(stored.id.robot);
  picture.set_format("jpeg");
  picture.set_data(jpeg->data(), jpeg->size());
  const std::string topics_of = "/" + stored.id.robot;
  if (auto written = topics.write(topics_of + "/picture", stored.stamp_ns, picture); !written) return written;
  const CameraModel& camera = keyframe->camera;
  foxglove::CameraCalibration calibration;
  calibration.set_frame_id(stored.id.robot);
  calibration.set_width(static_cast<uint32_t>(camera.width));
  calibration.set_height(static_cast<uint32_t>(camera.height));
  for (const double k : {camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0}) calibration.add_k(k);
  for (const double r : {1, 0, 0, 0, 1, 0, 0, 0, 1}) calibration.add_r(r);
  for (const double p : {camera.fx, 0.0, camera.cx, 0.0, 0.0, camera.fy, camera.cy, 0.0, 0.0, 0.0, 1.0, 0.0})
    calibration.add_p(p);
  return topics.write(topics_of + "/camera", stored.stamp_ns, calibration);
}

// Each robot's way in each map, at the time of its last keyframe there.
Result<void> writePaths(Topics& topics, const std::vector<StoredKeyframe>& keyframes) {
  std::map<std::pair<std::string, MapId>, std::map<std::pair<int64_t, KeyframeId>, Pose>> paths;
  for (const StoredKeyframe& keyframe : keyframes)
    paths[{keyframe.id.robot, keyframe.map}][{keyframe.stamp_ns, keyframe.id}] = keyframe.T_map_cam;
  for (const auto& [of, path] : paths) {
    foxglove::PosesInFrame poses;
    poses.set_frame_id(of.second);
    for (const auto& [when, pose] : path) fill(pose, *poses.add_poses());
    if (auto written = topics.write("/" + of.first + "/path", path.rbegin()->first.first, poses); !written)
      return written;
  }
  return {};
}

Result<size_t> writePoints(Topics& topics, const MapStore& store, const MapId& map, int64_t time_ns) {
  const auto tiles = store.tiles(map);
  if (!tiles) return tiles.error();
  struct Field {
    const char* name;
    uint32_t offset;
    foxglove::PackedElementField::NumericType type;
  };
  using Type = foxglove::PackedElementField;
  constexpr uint32_t kStride = 16;
  foxglove::PointCloud cloud;
  cloud.set_frame_id(map);
  fill(Pose(), *cloud.mutable_pose());
  cloud.set_point_stride(kStride);
  for (const Field& field : {Field{"x", 0, Type::FLOAT32}, Field{"y", 4, Type::FLOAT32}, Field{"z", 8, Type::FLOAT32},
                             Field{"red", 12, Type::UINT8}, Field{"green", 13, Type::UINT8},
                             Field{"blue", 14, Type::UINT8}, Field{"alpha", 15, Type::UINT8}}) {
    auto& added = *cloud.add_fields();
    added.set_name(field.name);
    added.set_offset(field.offset);
    added.set_type(field.type);
  }
  std::string& data = *cloud.mutable_data();
  for (const Tile& tile : *tiles)
    for (const MapPoint& point : pointsOf(tile)) {
      char row[kStride];
      std::memcpy(row, point.position.data(), 12);
      const uint8_t colour[4] = {point.colour.r, point.colour.g, point.colour.b, 255};
      std::memcpy(row + 12, colour, sizeof colour);
      data.append(row, sizeof row);
    }
  if (data.size() > kMostBytes)
    return Error{ErrorCode::kProblem, "map " + map + " has " + std::to_string(data.size() / kStride) +
                                          " points, more than one message holds; use --format tiles3d for them"};
  if (auto written = topics.write("/" + map + "/points", time_ns, cloud); !written) return written.error();
  return data.size() / kStride;
}

// At the time of the keyframe with which it came about.
Result<size_t> writeEvents(Topics& topics, const MapStore& store, const std::map<KeyframeId, int64_t>& times) {
  size_t events = 0;
  const auto tell = [&](const KeyframeId& when, foxglove::Log::Level level, const std::string& text) -> Result<void> {
    const auto time_ns = times.find(when);
    if (time_ns == times.end()) return {};  // of another map
    foxglove::Log log;
    log.set_level(level);
    log.set_name("mapping_core");
    log.set_message(text);
    ++events;
    return topics.write("/events", time_ns->second, log);
  };
  const auto merges = store.merges();
  if (!merges) return merges.error();
  for (const MergeRecord& merge : *merges) {
    if (merge.voters.empty()) continue;
    std::string text = "merge " + std::to_string(merge.number) + ": map " + merge.absorbed + " becomes part of " +
                       merge.kept + " by " + counted(merge.voters.size(), "vote");
    if (!merge.undone.empty()) text += "; taken back later: " + merge.undone;
    const auto level = merge.undone.empty() ? foxglove::Log::INFO : foxglove::Log::WARNING;
    if (auto told = tell(merge.voters.back(), level, text); !told) return told.error();
  }
  const auto verdicts = store.verdicts({true, "", ""});
  if (!verdicts) return verdicts.error();
  for (const MatchVerdict& verdict : *verdicts) {
    if (verdict.query.robot == verdict.candidate.robot) continue;
    const std::string text = "match: " + toString(verdict.query) + " sees what " + toString(verdict.candidate) + " saw";
    if (auto told = tell(verdict.query, foxglove::Log::DEBUG, text); !told) return told.error();
  }
  return events;
}

}  // namespace

Result<RecordingCounts> writeRecording(const MapStore& store, const std::string& path, const MapId& map,
                                       const std::function<void(size_t, size_t)>& progress) {
  auto keyframes = store.keyframes();
  if (!keyframes) return keyframes.error();
  std::erase_if(*keyframes,
                [&](const StoredKeyframe& one) { return one.map.empty() || (!map.empty() && one.map != map); });
  std::ranges::sort(*keyframes, {}, [](const StoredKeyframe& one) { return std::pair(one.stamp_ns, one.id); });
  std::map<KeyframeId, int64_t> times;
  std::map<MapId, int64_t> beginnings;
  for (const StoredKeyframe& keyframe : *keyframes) {
    if (keyframe.stamp_ns < 0)
      return Error{ErrorCode::kBadData, "keyframe " + toString(keyframe.id) + " is of time " +
                                            std::to_string(keyframe.stamp_ns) + " ns, expected none before 1970"};
    times[keyframe.id] = keyframe.stamp_ns;
    auto& begin = beginnings.emplace(keyframe.map, keyframe.stamp_ns).first->second;
    begin = std::min(begin, keyframe.stamp_ns);
  }
  auto writer = McapWriter::create(path, "CoMap " COMAP_VERSION);
  if (!writer) return writer.error();
  Topics topics(*writer);
  RecordingCounts counts;
  for (const auto& [of, begin] : beginnings) {
    const auto points = writePoints(topics, store, of, begin);
    if (!points) return points.error();
    counts.points += *points;
  }
  for (const StoredKeyframe& keyframe : *keyframes) {
    if (auto written = writePlace(topics, keyframe); !written) return written.error();
    if (auto written = writePicture(topics, store, keyframe); !written) return written.error();
    ++counts.poses;
    ++counts.pictures;
    if (progress) progress(counts.poses, keyframes->size());
  }
  if (auto written = writePaths(topics, *keyframes); !written) return written.error();
  const auto events = writeEvents(topics, store, times);
  if (!events) return events.error();
  counts.events = *events;
  if (auto finished = writer->finish(); !finished) return finished.error();
  return counts;
}

}  // namespace comap
