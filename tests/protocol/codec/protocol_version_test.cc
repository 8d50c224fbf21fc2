// Messages as another version of the protocol would write them.
#include <gtest/gtest.h>

#include "comap/v1/hello.pb.h"
#include "comap/v1/keyframe.pb.h"
#include "protocol/codec/codec.h"

namespace comap {
namespace {

std::vector<uint8_t> bytesOf(const google::protobuf::MessageLite& message) {
  std::vector<uint8_t> bytes(message.ByteSizeLong());
  message.SerializeToArray(bytes.data(), static_cast<int>(bytes.size()));
  return bytes;
}

v1::Hello hello(uint32_t major, uint32_t minor) {
  v1::Hello message;
  message.set_protocol_major(major);
  message.set_protocol_minor(minor);
  message.set_robot("r1");
  return message;
}

TEST(ProtocolVersion, AnotherMajorIsRefusedWithTheReason) {
  const auto back = decodeHello(bytesOf(hello(2, 0)));
  ASSERT_FALSE(back);
  EXPECT_EQ(back.error().code, ErrorCode::kBadData);
  EXPECT_EQ(back.error().text, "hello: protocol major 2, this build speaks 1");
  EXPECT_EQ(decodeHello(bytesOf(hello(0, 0))).error().text, "hello: protocol major 0, this build speaks 1");
}

TEST(ProtocolVersion, AnotherMajorIsToldEvenIfItsFieldsHaveOtherTypes) {
  v1::Envelope envelope;
  envelope.set_protocol_major(7);
  auto bytes = bytesOf(envelope);
  // Field 3 as text that is not UTF-8, which `robot` must be.
  for (const int byte : {0x1a, 0x02, 0xff, 0xfe}) bytes.push_back(static_cast<uint8_t>(byte));
  EXPECT_EQ(decodeHello(bytes).error().text, "hello: protocol major 7, this build speaks 1");
}

TEST(ProtocolVersion, ANewerMinorWithUnknownFieldsPasses) {
  auto bytes = bytesOf(hello(1, 9));
  // Field 100, three bytes.
  for (const int byte : {0xa2, 0x06, 0x03, 0x01, 0x02, 0x03}) bytes.push_back(static_cast<uint8_t>(byte));
  const auto back = decodeHello(bytes);
  ASSERT_TRUE(back) << back.error().text;
  EXPECT_EQ(back->robot, "r1");
}

TEST(ProtocolVersion, EveryDecoderChecks) {
  v1::Envelope envelope;
  envelope.set_protocol_major(3);
  const auto bytes = bytesOf(envelope);
  const auto tells = [](const auto& result) {
    return !result && result.error().text.find(": protocol major 3, this build speaks 1") != std::string::npos;
  };
  EXPECT_TRUE(tells(decodeKeyframe(bytes)));
  EXPECT_TRUE(tells(decodeKeyframeId(bytes)));
  EXPECT_TRUE(tells(decodeAcknowledgement(bytes)));
  EXPECT_TRUE(tells(decodeCorrection(bytes)));
  EXPECT_TRUE(tells(decodeInterest(bytes)));
  EXPECT_TRUE(tells(decodeTile(bytes)));
  EXPECT_TRUE(tells(decodeStatus(bytes)));
  EXPECT_TRUE(tells(decodeMatchVerdict(bytes)));
  EXPECT_TRUE(tells(decodeMergeRecord(bytes)));
  EXPECT_TRUE(tells(decodeCoreStatus(bytes)));
}

TEST(ProtocolVersion, AQuaternionThatIsNoneIsRefused) {
  v1::Keyframe keyframe;
  keyframe.set_protocol_major(1);
  keyframe.mutable_id()->set_robot("r1");
  keyframe.mutable_camera()->set_width(64);
  keyframe.mutable_camera()->set_height(48);
  keyframe.mutable_t_odom_cam()->set_qw(2);
  EXPECT_NE(decodeKeyframe(bytesOf(keyframe)).error().text.find("quaternion of norm 2"), std::string::npos);
}

TEST(ProtocolVersion, ACameraCannotClaimAHugeImage) {
  v1::Keyframe keyframe;
  keyframe.set_protocol_major(1);
  keyframe.mutable_id()->set_robot("r1");
  keyframe.mutable_camera()->set_width(4000000000u);
  keyframe.mutable_camera()->set_height(4000000000u);
  EXPECT_NE(decodeKeyframe(bytesOf(keyframe)).error().text.find("camera is 4000000000x4000000000"), std::string::npos);
}

}  // namespace
}  // namespace comap
