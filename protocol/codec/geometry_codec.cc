#include "protocol/codec/geometry_codec.h"

#include <cmath>

#include "protocol/codec/limits.h"

namespace comap::codec {

void write(const Pose& pose, v1::Pose* to) {
  to->set_qw(pose.rotation().w());
  to->set_qx(pose.rotation().x());
  to->set_qy(pose.rotation().y());
  to->set_qz(pose.rotation().z());
  to->set_tx(pose.translation().x());
  to->set_ty(pose.translation().y());
  to->set_tz(pose.translation().z());
}

Result<Pose> readPose(const v1::Pose& from, const std::string& field) {
  const Eigen::Quaterniond rotation(from.qw(), from.qx(), from.qy(), from.qz());
  const Eigen::Vector3d translation(from.tx(), from.ty(), from.tz());
  if (!translation.allFinite() || !rotation.coeffs().allFinite()) {
    return Error{ErrorCode::kBadData, field + " is not finite"};
  }
  if (!(std::abs(rotation.norm() - 1) <= 1e-3)) {
    return Error{ErrorCode::kBadData,
                 field + " has a quaternion of norm " + std::to_string(rotation.norm()) + ", expected 1"};
  }
  return Pose(rotation, translation);
}

void write(const MapPose& pose, v1::MapPose* to) {
  to->set_map(pose.map);
  write(pose.T_map_cam, to->mutable_t_map_cam());
}

Result<MapPose> readMapPose(const v1::MapPose& from, const std::string& field) {
  const auto T_map_cam = readPose(from.t_map_cam(), field + ".T_map_cam");
  if (!T_map_cam) return T_map_cam.error();
  return MapPose{from.map(), *T_map_cam};
}

void write(const KeyframeId& id, v1::KeyframeId* to) {
  to->set_robot(id.robot);
  to->set_session(id.session);
  to->set_sequence(id.sequence);
}

KeyframeId readId(const v1::KeyframeId& from) { return {from.robot(), from.session(), from.sequence()}; }

void write(const CameraModel& camera, v1::Camera* to) {
  to->set_fx(camera.fx);
  to->set_fy(camera.fy);
  to->set_cx(camera.cx);
  to->set_cy(camera.cy);
  to->set_width(static_cast<uint32_t>(camera.width));
  to->set_height(static_cast<uint32_t>(camera.height));
}

Result<CameraModel> readCamera(const v1::Camera& from, const std::string& field) {
  if (from.width() > kMaxImageSide || from.height() > kMaxImageSide) {
    return Error{ErrorCode::kBadData, field + " is " + std::to_string(from.width()) + "x" +
                                          std::to_string(from.height()) + ", expected sides of " +
                                          std::to_string(kMinImageSide) + " to " + std::to_string(kMaxImageSide)};
  }
  return CameraModel{
      from.fx(), from.fy(), from.cx(), from.cy(), static_cast<int>(from.width()), static_cast<int>(from.height())};
}

void write(const Matrix6d& information, google::protobuf::RepeatedField<double>* to) {
  to->Reserve(21);
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column) to->Add(information(row, column));
  }
}

Result<Matrix6d> readInformation(const google::protobuf::RepeatedField<double>& from, const std::string& field) {
  if (from.size() != 21) {
    return Error{ErrorCode::kBadData, field + " has " + std::to_string(from.size()) + " values, expected 21"};
  }
  Matrix6d information;
  int next = 0;
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column) information(row, column) = information(column, row) = from[next++];
  }
  return information;
}

}  // namespace comap::codec
