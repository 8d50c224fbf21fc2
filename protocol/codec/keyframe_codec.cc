#include "protocol/codec/keyframe_codec.h"

#include <algorithm>
#include <string>

#include "comap/v1/keyframe.pb.h"
#include "protocol/codec/checks.h"
#include "protocol/codec/depth_codec.h"
#include "protocol/codec/envelope.h"
#include "protocol/codec/fern_code_codec.h"
#include "protocol/codec/geometry_codec.h"
#include "protocol/codec/limits.h"
#include "protocol/codec/section.h"

namespace comap {
namespace {

constexpr int kHitsLevel = 3;  // of zstd

codec::Check checkScalars(const Keyframe& keyframe) {
  codec::Check check("keyframe");
  check.id("id", keyframe.id)
      .camera("camera", keyframe.camera)
      .pose("T_odom_cam", keyframe.T_odom_cam)
      .range("inlier_ratio", keyframe.inlier_ratio, 0, 1);
  const uint32_t most_skipped = std::min(keyframe.id.sequence, kMaxSkipped);
  check.that(keyframe.skipped <= most_skipped, "skipped",
             "is " + std::to_string(keyframe.skipped) + ", expected at most " + std::to_string(most_skipped));
  if (keyframe.believed)
    check.map("believed.map", keyframe.believed->map).pose("believed.T_map_cam", keyframe.believed->T_map_cam);
  if (keyframe.linked) {
    check.pose("T_link_this", keyframe.T_link_this).information("information", keyframe.information);
    check.that(keyframe.linked_to < keyframe.id.sequence, "linked_to",
               "is " + std::to_string(keyframe.linked_to) + ", expected less than the keyframe's own " +
                   std::to_string(keyframe.id.sequence));
  }
  return check;
}

std::span<const uint8_t> bytesOf(const std::string& text) {
  return {reinterpret_cast<const uint8_t*>(text.data()), text.size()};
}

// The side of an image that is cut into blocks, the last of which may be smaller.
int blocks(int side) { return (side + kHitBlock - 1) / kHitBlock; }

Result<Image<uint8_t>> readHits(const std::string& packed, const CameraModel& camera) {
  Image<uint8_t> hits;
  if (packed.empty()) return hits;
  hits = Image<uint8_t>(blocks(camera.width), blocks(camera.height));
  const auto raw = codec::decompress(bytesOf(packed), hits.size(), "keyframe: depth_hits");
  if (!raw) return raw.error();
  std::copy(raw->begin(), raw->end(), hits.data());
  return hits;
}

Result<Keyframe> readAllButImages(const v1::Keyframe& message) {
  Keyframe keyframe;
  keyframe.id = codec::readId(message.id());
  keyframe.stamp_ns = message.stamp_ns();
  const auto camera = codec::readCamera(message.camera(), "keyframe: camera");
  if (!camera) return camera.error();
  keyframe.camera = *camera;
  const auto T_odom_cam = codec::readPose(message.t_odom_cam(), "keyframe: T_odom_cam");
  if (!T_odom_cam) return T_odom_cam.error();
  keyframe.T_odom_cam = *T_odom_cam;
  keyframe.linked = message.linked();
  if (keyframe.linked) {
    const auto T_link_this = codec::readPose(message.t_link_this(), "keyframe: T_link_this");
    if (!T_link_this) return T_link_this.error();
    keyframe.T_link_this = *T_link_this;
    keyframe.linked_to = message.has_linked_to() ? message.linked_to() : std::max(1u, keyframe.id.sequence) - 1;
    const auto information = codec::readInformation(message.information(), "keyframe: information");
    if (!information) return information.error();
    keyframe.information = *information;
  }
  keyframe.inlier_ratio = message.inlier_ratio();
  keyframe.skipped = message.skipped();
  if (message.has_believed()) {
    auto believed = codec::readMapPose(message.believed(), "keyframe: believed");
    if (!believed) return believed.error();
    keyframe.believed = std::move(*believed);
  }
  if (const auto checked = checkScalars(keyframe); !checked.ok()) return checked.error(ErrorCode::kBadData);
  auto fern_code = codec::readFernCode(message.fern_code(), "keyframe: fern_code");
  if (!fern_code) return fern_code.error();
  keyframe.fern_code = std::move(*fern_code);
  return keyframe;
}

}  // namespace

Result<std::vector<uint8_t>> encodeKeyframe(const Keyframe& keyframe, int jpeg_quality) {
  const int width = keyframe.camera.width, height = keyframe.camera.height;
  auto check = checkScalars(keyframe);
  check.that(keyframe.colour.width() == width && keyframe.colour.height() == height, "colour",
             "is not of the camera's size");
  check.that(keyframe.depth.width() == width && keyframe.depth.height() == height, "depth",
             "is not of the camera's size");
  check.that(keyframe.depth_hits.empty() ||
                 (keyframe.depth_hits.width() == blocks(width) && keyframe.depth_hits.height() == blocks(height)),
             "depth_hits", "has not one value a block of depth");
  if (!check.ok()) return check.error(ErrorCode::kWrongUse);
  const auto colour = encodeColour(keyframe.colour, jpeg_quality);
  if (!colour) return colour.error();
  const auto depth = encodeDepth(keyframe.depth);
  if (!depth) return depth.error();

  v1::Keyframe message;
  codec::write(keyframe.id, message.mutable_id());
  message.set_stamp_ns(keyframe.stamp_ns);
  codec::write(keyframe.camera, message.mutable_camera());
  message.set_colour(colour->data(), colour->size());
  message.set_depth(depth->data(), depth->size());
  if (const auto written = codec::write(keyframe.fern_code, message.mutable_fern_code(), "keyframe: fern_code");
      !written) {
    return written.error();
  }
  codec::write(keyframe.T_odom_cam, message.mutable_t_odom_cam());
  message.set_linked(keyframe.linked);
  if (keyframe.linked) {
    codec::write(keyframe.T_link_this, message.mutable_t_link_this());
    codec::write(keyframe.information, message.mutable_information());
    message.set_linked_to(keyframe.linked_to);
  }
  if (!keyframe.depth_hits.empty()) {
    const auto hits = codec::compress({keyframe.depth_hits.data(), keyframe.depth_hits.size()}, kHitsLevel);
    message.set_depth_hits(hits.data(), hits.size());
  }
  message.set_inlier_ratio(keyframe.inlier_ratio);
  message.set_skipped(keyframe.skipped);
  if (keyframe.believed) codec::write(*keyframe.believed, message.mutable_believed());
  return codec::serialise(message, "keyframe", kMaxLargeMessageBytes);
}

Result<Keyframe> decodeKeyframe(std::span<const uint8_t> bytes) {
  const auto message = codec::parse<v1::Keyframe>(bytes, "keyframe", kMaxLargeMessageBytes);
  if (!message) return message.error();
  auto keyframe = readAllButImages(*message);
  if (!keyframe) return keyframe;
  const CameraModel& camera = keyframe->camera;
  auto depth = decodeDepth(bytesOf(message->depth()), camera.width, camera.height);
  if (!depth) return Error{ErrorCode::kBadData, "keyframe: " + depth.error().text};
  auto colour = decodeColour(bytesOf(message->colour()), camera.width, camera.height);
  if (!colour) return Error{ErrorCode::kBadData, "keyframe: " + colour.error().text};
  auto hits = readHits(message->depth_hits(), camera);
  if (!hits) return hits.error();
  keyframe->depth_hits = std::move(*hits);
  keyframe->depth = std::move(*depth);
  keyframe->colour = std::move(*colour);
  return keyframe;
}

Result<Keyframe> decodeKeyframeWithoutImages(std::span<const uint8_t> bytes) {
  const auto message = codec::parse<v1::Keyframe>(bytes, "keyframe", kMaxLargeMessageBytes);
  if (!message) return message.error();
  return readAllButImages(*message);
}

Result<std::vector<uint8_t>> thinColour(std::span<const uint8_t> bytes, int jpeg_quality) {
  auto message = codec::parse<v1::Keyframe>(bytes, "keyframe", kMaxLargeMessageBytes);
  if (!message) return message.error();
  const auto camera = codec::readCamera(message->camera(), "keyframe: camera");
  if (!camera) return camera.error();
  const auto colour = decodeColour(bytesOf(message->colour()), camera->width, camera->height);
  if (!colour) return colour.error();
  const auto thinner = encodeColour(*colour, jpeg_quality);
  if (!thinner) return thinner.error();
  if (thinner->size() < message->colour().size()) message->set_colour(thinner->data(), thinner->size());
  return codec::serialise(*message, "keyframe", kMaxLargeMessageBytes);
}

Result<std::vector<uint8_t>> relinkKeyframe(std::span<const uint8_t> bytes, const KeyframeLink& link,
                                            uint32_t skipped) {
  auto message = codec::parse<v1::Keyframe>(bytes, "keyframe", kMaxLargeMessageBytes);
  if (!message) return message.error();
  message->set_linked(link.linked);
  message->clear_t_link_this();
  message->clear_information();
  message->clear_linked_to();
  if (link.linked) {
    codec::write(link.T_link_this, message->mutable_t_link_this());
    codec::write(link.information, message->mutable_information());
    message->set_linked_to(link.linked_to);
  }
  message->set_skipped(skipped);
  return codec::serialise(*message, "keyframe", kMaxLargeMessageBytes);
}

Result<KeyframeHead> decodeKeyframeId(std::span<const uint8_t> bytes) {
  const auto message = codec::parse<v1::KeyframeHead>(bytes, "keyframe", kMaxLargeMessageBytes);
  if (!message) return message.error();
  const KeyframeHead head{codec::readId(message->id()), message->stamp_ns()};
  if (const auto checked = codec::Check("keyframe").id("id", head.id); !checked.ok()) {
    return checked.error(ErrorCode::kBadData);
  }
  return head;
}

}  // namespace comap
