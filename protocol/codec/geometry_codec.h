// Poses, cameras, information matrices and keyframe names inside messages. Inside the codec only.
#pragma once

#include <google/protobuf/repeated_field.h>

#include <string>

#include "comap/v1/common.pb.h"
#include "protocol/types/camera.h"
#include "protocol/types/ids.h"
#include "protocol/types/map_pose.h"
#include "protocol/types/pose.h"
#include "protocol/types/result.h"

namespace comap::codec {

void write(const Pose& pose, v1::Pose* to);
/// kBadData unless finite with a quaternion of norm 1 within 1e-3. `field` names it in the error.
Result<Pose> readPose(const v1::Pose& from, const std::string& field);

void write(const MapPose& pose, v1::MapPose* to);
/// kBadData as for its pose. The map's name is not checked.
Result<MapPose> readMapPose(const v1::MapPose& from, const std::string& field);

void write(const KeyframeId& id, v1::KeyframeId* to);
KeyframeId readId(const v1::KeyframeId& from);

void write(const CameraModel& camera, v1::Camera* to);
/// kBadData if a side is beyond int.
Result<CameraModel> readCamera(const v1::Camera& from, const std::string& field);

void write(const Matrix6d& information, google::protobuf::RepeatedField<double>* to);
/// kBadData unless there are 21 values.
Result<Matrix6d> readInformation(const google::protobuf::RepeatedField<double>& from, const std::string& field);

}  // namespace comap::codec
