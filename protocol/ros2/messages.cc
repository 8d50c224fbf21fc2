#include "protocol/ros2/messages.h"

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>

#include <algorithm>
#include <cstring>

namespace comap::ros2 {
namespace {

using eprosima::fastcdr::Cdr;
using eprosima::fastcdr::FastBuffer;

constexpr int64_t kSecond_ns = 1'000'000'000;
constexpr uint8_t kFloat32 = 7;  // sensor_msgs/PointField

void put(Cdr& cdr, const Header& header) {
  int64_t seconds = header.stamp_ns / kSecond_ns, rest = header.stamp_ns % kSecond_ns;
  if (rest < 0) --seconds, rest += kSecond_ns;
  cdr << static_cast<int32_t>(seconds) << static_cast<uint32_t>(rest) << header.frame;
}

void put(Cdr& cdr, const Eigen::Vector3d& v) { cdr << v.x() << v.y() << v.z(); }

void put(Cdr& cdr, const Pose& pose) {
  put(cdr, Eigen::Vector3d(pose.translation()));
  const Eigen::Quaterniond q(pose.rotation());
  cdr << q.x() << q.y() << q.z() << q.w();
}

void putZeros(Cdr& cdr, int count) {
  for (int i = 0; i < count; ++i) cdr << 0.0;
}

template <class Fill>
std::vector<uint8_t> bytesOf(Fill fill) {
  FastBuffer buffer;
  Cdr cdr(buffer, Cdr::LITTLE_ENDIANNESS, Cdr::DDS_CDR);
  cdr.serialize_encapsulation();
  fill(cdr);
  const auto* begin = reinterpret_cast<const uint8_t*>(buffer.getBuffer());
  return {begin, begin + cdr.getSerializedDataLength()};
}

}  // namespace

std::vector<uint8_t> serialise(const Odometry& message) {
  return bytesOf([&](Cdr& cdr) {
    put(cdr, message.header);
    cdr << message.child_frame;
    put(cdr, message.pose);
    putZeros(cdr, 36);
    put(cdr, message.linear_mps);
    put(cdr, message.angular_radps);
    putZeros(cdr, 36);
  });
}

std::vector<uint8_t> serialise(const std::vector<Transform>& message) {
  return bytesOf([&](Cdr& cdr) {
    cdr << static_cast<uint32_t>(message.size());
    for (const Transform& one : message) {
      put(cdr, one.header);
      cdr << one.child_frame;
      put(cdr, one.pose);
    }
  });
}

std::vector<uint8_t> serialise(const Path& message) {
  return bytesOf([&](Cdr& cdr) {
    put(cdr, message.header);
    cdr << static_cast<uint32_t>(message.poses.size());
    for (const Transform& one : message.poses) {
      put(cdr, one.header);
      put(cdr, one.pose);
    }
  });
}

std::vector<uint8_t> serialise(const PointCloud& message) {
  constexpr uint32_t kPointBytes = 16;
  std::vector<uint8_t> data(message.points.size() * kPointBytes);
  for (size_t i = 0; i < message.points.size(); ++i) {
    const PointCloud::Point& point = message.points[i];
    uint8_t* to = data.data() + i * kPointBytes;
    const float position[3] = {point.x, point.y, point.z};
    std::memcpy(to, position, sizeof position);
    const uint8_t colour[4] = {point.b, point.g, point.r, 0};
    std::memcpy(to + sizeof position, colour, sizeof colour);
  }
  return bytesOf([&](Cdr& cdr) {
    put(cdr, message.header);
    const auto count = static_cast<uint32_t>(message.points.size());
    cdr << uint32_t{1} << count << uint32_t{4};
    uint32_t offset = 0;
    for (const char* name : {"x", "y", "z", "rgb"}) {
      cdr << std::string(name) << offset << kFloat32 << uint32_t{1};
      offset += 4;
    }
    cdr << false << kPointBytes << count * kPointBytes << data << true;
  });
}

std::vector<uint8_t> serialise(const std::string& message) {
  return bytesOf([&](Cdr& cdr) { cdr << message; });
}

std::string rosName(const std::string& robot) {
  std::string name = robot;
  std::replace(name.begin(), name.end(), '-', '_');
  return !name.empty() && name.front() >= '0' && name.front() <= '9' ? "robot_" + name : name;
}

Pose rosFromCamera() {
  Eigen::Matrix3d axes;
  axes << 0, 0, 1, -1, 0, 0, 0, -1, 0;  // x = forward, y = -right, z = -down
  return Pose(Eigen::Quaterniond(axes), Eigen::Vector3d::Zero());
}

Pose rosPose(const Pose& T) { return rosFromCamera() * T * rosFromCamera().inverse(); }

}  // namespace comap::ros2
