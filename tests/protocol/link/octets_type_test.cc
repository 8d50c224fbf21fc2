// The bytes on the wire, fixed: another DDS implementation must find exactly these.
#include "protocol/link/octets_type.h"

#include <gtest/gtest.h>

#include <random>

namespace comap {
namespace {

using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::SerializedPayload_t;

std::vector<uint8_t> serialise(Octets octets) {
  OctetsType type;
  SerializedPayload_t sample(type.getSerializedSizeProvider(&octets)());
  EXPECT_TRUE(type.serialize(&octets, &sample));
  return {sample.data, sample.data + sample.length};
}

Octets deserialise(const std::vector<uint8_t>& bytes) {
  OctetsType type;
  SerializedPayload_t sample(static_cast<uint32_t>(bytes.size()));
  std::copy(bytes.begin(), bytes.end(), sample.data);
  sample.length = static_cast<uint32_t>(bytes.size());
  Octets octets;
  EXPECT_TRUE(type.deserialize(&sample, &octets));
  return octets;
}

TEST(OctetsType, IsPlainLittleEndianCdr) {
  const std::vector<uint8_t> expected = {0, 1, 0, 0, 3, 0, 0, 0, 'r', '1', 0, 0, 2, 0, 0, 0, 0xaa, 0xbb};
  EXPECT_EQ(serialise({"r1", {0xaa, 0xbb}}), expected);
  const std::vector<uint8_t> nobody = {0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
  EXPECT_EQ(serialise({"", {}}), nobody);
}

TEST(OctetsType, ReadsBigEndianToo) {
  const Octets octets = deserialise({0, 0, 0, 0, 0, 0, 0, 3, 'r', '1', 0, 0, 0, 0, 0, 2, 0xaa, 0xbb});
  EXPECT_FALSE(octets.damaged);
  EXPECT_EQ(octets.robot, "r1");
  EXPECT_EQ(octets.payload, (std::vector<uint8_t>{0xaa, 0xbb}));
}

TEST(OctetsType, KeyHashIsMd5OfTheBigEndianKey) {
  Octets octets{"r1", {1, 2, 3}};
  InstanceHandle_t handle;
  OctetsType type;
  ASSERT_TRUE(type.getKey(&octets, &handle, false));
  // md5 of 00 00 00 03 'r' '1' 00
  const uint8_t expected[16] = {0xf7, 0xf1, 0xa3, 0xd0, 0x01, 0xf9, 0x81, 0x1a,
                                0x57, 0xb1, 0x26, 0x7e, 0x4d, 0xfe, 0x0b, 0x5d};
  for (int i = 0; i < 16; ++i) EXPECT_EQ(handle.value[i], expected[i]) << i;
}

TEST(OctetsType, DamagedSamplesAreToldAndNeverReadBeyond) {
  const std::vector<uint8_t> good = serialise({"robot-7", std::vector<uint8_t>(40, 9)});
  EXPECT_FALSE(deserialise(good).damaged);
  for (size_t length = 0; length < good.size(); ++length) {
    EXPECT_TRUE(deserialise({good.begin(), good.begin() + static_cast<std::ptrdiff_t>(length)}).damaged) << length;
  }
  std::mt19937 random(1);
  for (int round = 0; round < 2000; ++round) {
    auto bad = good;
    for (int hits = 0; hits < 3; ++hits) bad[random() % 24] = static_cast<uint8_t>(random());
    const Octets octets = deserialise(bad);
    EXPECT_LE(octets.payload.size(), bad.size());
    EXPECT_LE(octets.robot.size(), 64u);
  }
}

}  // namespace
}  // namespace comap
