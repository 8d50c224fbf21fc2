#include "protocol/codec/keyframe_codec.h"

#include "comap/v1/keyframe.pb.h"
#include "protocol/codec/checks.h"
#include "protocol/codec/depth_codec.h"
#include "protocol/codec/envelope.h"
#include "protocol/codec/fern_code_codec.h"
#include "protocol/codec/geometry_codec.h"
#include "protocol/codec/limits.h"

namespace comap {
namespace {

codec::Check checkScalars(const Keyframe& keyframe) {
  codec::Check check("keyframe");
  check.id("id", keyframe.id)
      .camera("camera", keyframe.camera)
      .pose("T_odom_cam", keyframe.T_odom_cam)
      .range("inlier_ratio", keyframe.inlier_ratio, 0, 1);
  if (keyframe.linked) check.pose("T_prev_this", keyframe.T_prev_this).information("information", keyframe.information);
  return check;
}

std::span<const uint8_t> bytesOf(const std::string& text) {
  return {reinterpret_cast<const uint8_t*>(text.data()), text.size()};
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
    const auto T_prev_this = codec::readPose(message.t_prev_this(), "keyframe: T_prev_this");
    if (!T_prev_this) return T_prev_this.error();
    keyframe.T_prev_this = *T_prev_this;
    const auto information = codec::readInformation(message.information(), "keyframe: information");
    if (!information) return information.error();
    keyframe.information = *information;
  }
  keyframe.inlier_ratio = message.inlier_ratio();
  if (const auto checked = checkScalars(keyframe); !checked.ok()) return checked.error(ErrorCode::kBadData);
  auto fern_code = codec::readFernCode(message.fern_code());
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
  if (const auto written = codec::write(keyframe.fern_code, message.mutable_fern_code()); !written) {
    return written.error();
  }
  codec::write(keyframe.T_odom_cam, message.mutable_t_odom_cam());
  message.set_linked(keyframe.linked);
  if (keyframe.linked) {
    codec::write(keyframe.T_prev_this, message.mutable_t_prev_this());
    codec::write(keyframe.information, message.mutable_information());
  }
  message.set_inlier_ratio(keyframe.inlier_ratio);
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
  keyframe->depth = std::move(*depth);
  keyframe->colour = std::move(*colour);
  return keyframe;
}

Result<Keyframe> decodeKeyframeWithoutImages(std::span<const uint8_t> bytes) {
  const auto message = codec::parse<v1::Keyframe>(bytes, "keyframe", kMaxLargeMessageBytes);
  if (!message) return message.error();
  return readAllButImages(*message);
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
