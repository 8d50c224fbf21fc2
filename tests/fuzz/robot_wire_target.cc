// What an agent and a program on its robot say to each other: the first byte chooses the message, the rest is its body.
#include "robot_api/wire.h"
#include "tests/fuzz/fuzz.h"

using namespace comap;

namespace {

// What was read can be written, and is then read as the same.
template <class Decode>
void check(const Decode& decode, std::span<const uint8_t> body) {
  const auto read = decode(body);
  if (!read) return;
  const std::string once = robot_api::encode(*read);
  fuzz::require(once.size() <= robot_api::kHeaderBytes + body.size(), "nothing is added to what was read");
  const auto* bytes = reinterpret_cast<const uint8_t*>(once.data());
  const auto again = decode({bytes + robot_api::kHeaderBytes, bytes + once.size()});
  fuzz::require(again && robot_api::encode(*again) == once, "what was read can be written and read");
}

}  // namespace

COMAP_FUZZ_TARGET(bytes) {
  if (bytes.empty()) return;
  const auto body = bytes.subspan(1);
  switch (bytes[0]) {
    case 0:
      if (body.size() >= robot_api::kHeaderBytes)
        (void)robot_api::decodeHeader(body.first<robot_api::kHeaderBytes>(), robot_api::kMaxAnswerBytes);
      return;
    case 1:
      return check(robot_api::decodeGreeting, body);
    case 2:
      return check(robot_api::decodePose, body);
    case 4:
      return check(robot_api::decodeSurfelsHead, body);
    case 5:
      return check(robot_api::decodeTile, body);
    case 7:
      return check(robot_api::decodeRefusal, body);
    case 16:
      return check(robot_api::decodeAskPose, body);
    case 17:
      return check(robot_api::decodeAskSurfels, body);
    default:
      return;
  }
}
