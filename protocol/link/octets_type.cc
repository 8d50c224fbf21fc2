#include "protocol/link/octets_type.h"

#include <fastrtps/utils/md5.h>

#include <cstring>

#include "protocol/codec/limits.h"

namespace comap {
namespace {

using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::SerializedPayload_t;

constexpr uint32_t kEncapsulationBytes = 4;
constexpr uint32_t kMaxRobotBytes = 64;

uint32_t padded(uint32_t size) { return (size + 3) & ~3u; }

// Encapsulation, length of robot with its NUL, robot, padding to 4, length of payload, payload.
uint32_t payloadOffset(size_t robot_size) {
  return kEncapsulationBytes + 4 + padded(static_cast<uint32_t>(robot_size) + 1) + 4;
}

void put32(uint32_t value, uint8_t* to) {
  for (int i = 0; i < 4; ++i) to[i] = static_cast<uint8_t>(value >> (8 * i));
}

uint32_t get32(const uint8_t* from, bool little_endian) {
  uint32_t value = 0;
  for (int i = 0; i < 4; ++i) value |= static_cast<uint32_t>(from[i]) << (little_endian ? 8 * i : 24 - 8 * i);
  return value;
}

struct Parts {
  std::string_view robot;
  const uint8_t* payload = nullptr;
  uint32_t payload_size = 0;
};

std::optional<Parts> partsOf(const SerializedPayload_t& sample) {
  const uint8_t* bytes = sample.data;
  const uint32_t size = sample.length;
  if (bytes == nullptr || size < kEncapsulationBytes + 4 || bytes[0] != 0 || bytes[1] > 1) return std::nullopt;
  const bool little_endian = bytes[1] == 1;
  const uint32_t robot_size = get32(bytes + kEncapsulationBytes, little_endian);
  if (robot_size == 0 || robot_size > kMaxRobotBytes) return std::nullopt;
  const uint32_t offset = payloadOffset(robot_size - 1);
  if (size < offset || bytes[kEncapsulationBytes + 4 + robot_size - 1] != 0) return std::nullopt;
  Parts parts;
  parts.robot = {reinterpret_cast<const char*>(bytes) + kEncapsulationBytes + 4, robot_size - 1};
  parts.payload = bytes + offset;
  parts.payload_size = get32(bytes + offset - 4, little_endian);
  if (parts.payload_size > kMaxLargeMessageBytes || parts.payload_size > size - offset) return std::nullopt;
  return parts;
}

}  // namespace

OctetsType::OctetsType() {
  setName("comap::v1::Octets");
  m_typeSize = 4096;  // a first guess at a sample's size; histories grow beyond it
  m_isGetKeyDefined = true;
}

bool OctetsType::serialize(void* data, SerializedPayload_t* to) {
  const auto& octets = *static_cast<const Octets*>(data);
  const uint32_t offset = payloadOffset(octets.robot.size());
  const uint32_t size = offset + static_cast<uint32_t>(octets.payload.size());
  if (to->max_size < size) return false;
  std::memset(to->data, 0, offset);
  to->data[1] = 1;
  put32(static_cast<uint32_t>(octets.robot.size()) + 1, to->data + kEncapsulationBytes);
  std::memcpy(to->data + kEncapsulationBytes + 4, octets.robot.data(), octets.robot.size());
  put32(static_cast<uint32_t>(octets.payload.size()), to->data + offset - 4);
  if (!octets.payload.empty()) std::memcpy(to->data + offset, octets.payload.data(), octets.payload.size());
  to->encapsulation = CDR_LE;
  to->length = size;
  return true;
}

bool OctetsType::deserialize(SerializedPayload_t* from, void* data) {
  auto& octets = *static_cast<Octets*>(data);
  const auto parts = partsOf(*from);
  octets.damaged = !parts;
  octets.robot = parts ? std::string(parts->robot) : std::string();
  octets.payload.clear();
  if (parts) octets.payload.assign(parts->payload, parts->payload + parts->payload_size);
  return true;
}

std::function<uint32_t()> OctetsType::getSerializedSizeProvider(void* data) {
  return [data] {
    const auto& octets = *static_cast<const Octets*>(data);
    return payloadOffset(octets.robot.size()) + static_cast<uint32_t>(octets.payload.size());
  };
}

void* OctetsType::createData() { return new Octets; }

void OctetsType::deleteData(void* data) { delete static_cast<Octets*>(data); }

bool OctetsType::getKey(void* data, InstanceHandle_t* handle, bool) {
  // The standard's key hash: MD5 of the key in big-endian CDR, as an unbounded string may pass 16 bytes.
  const auto& robot = static_cast<const Octets*>(data)->robot;
  std::vector<uint8_t> key(4 + robot.size() + 1, 0);
  const auto size = static_cast<uint32_t>(robot.size()) + 1;
  for (int i = 0; i < 4; ++i) key[static_cast<size_t>(i)] = static_cast<uint8_t>(size >> (24 - 8 * i));
  std::memcpy(key.data() + 4, robot.data(), robot.size());
  MD5 md5;
  md5.init();
  md5.update(key.data(), static_cast<unsigned int>(key.size()));
  md5.finalize();
  for (uint8_t i = 0; i < 16; ++i) handle->value[i] = md5.digest[i];
  return true;
}

}  // namespace comap
