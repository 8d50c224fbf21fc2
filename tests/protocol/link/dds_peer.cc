// One end of a link, in a process (and network) of its own: a robot that sends keyframes, or a core that answers them.
//   dds_peer core|robot INTERFACE PROFILE CORE_ADDRESS|DISCOVERY:PORT|- KEYS|- KEYFRAMES
// Every payload repeats a known pattern. Exit code 0 if all came, whole, and was answered; else the
// step that failed, which it says.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <thread>

#include "protocol/link/dds_link.h"

namespace {

using namespace comap;
using namespace std::chrono_literals;

constexpr std::string_view kPattern = "comap-test-pattern-0123456789ABCDEF";

std::vector<uint8_t> patternOf(size_t size) {
  std::vector<uint8_t> bytes(size);
  for (size_t i = 0; i < size; ++i) bytes[i] = static_cast<uint8_t>(kPattern[i % kPattern.size()]);
  return bytes;
}

int failed(int step, const std::string& what) {
  std::fprintf(stderr, "dds_peer: %s\n", what.c_str());
  return step;
}

bool awaitPeer(const Link& link) {
  for (int i = 0; i < 600 && link.peers() == 0; ++i) std::this_thread::sleep_for(50ms);
  return link.peers() > 0;
}

// As a core does: a tile is for who is there, and tried again until its writer has found the robot.
Result<void> sendTile(Link& link) {
  Result<void> sent;
  for (int i = 0; i < 600; ++i) {
    if ((sent = link.publish(Topic::kTile, "a", patternOf(500000)))) return {};
    std::this_thread::sleep_for(50ms);
  }
  return sent;
}

// Until DDS has handed it over; who leaves before takes it along.
bool awaitDelivery(const Link& link, Topic topic) {
  for (int i = 0; i < 600 && !link.delivered(topic, "a"); ++i) std::this_thread::sleep_for(50ms);
  return link.delivered(topic, "a");
}

int beCore(Link& link, int keyframes) {
  for (int got = 0; got < keyframes;) {
    const auto delivery = link.receive(30s);
    if (!delivery) return failed(5, "core: only " + std::to_string(got) + " keyframes came");
    if (delivery->topic != Topic::kKeyframe) continue;
    if (delivery->payload != patternOf(300000)) return failed(6, "core: a keyframe of other bytes than were sent");
    ++got;
    if (auto sent = link.publish(Topic::kAck, "a", std::vector<uint8_t>{static_cast<uint8_t>(got)}); !sent)
      return failed(7, "core: " + sent.error().text);
  }
  if (auto sent = sendTile(link); !sent) return failed(8, "core: " + sent.error().text);
  // Until the robot says that it has it.
  while (const auto delivery = link.receive(30s))
    if (delivery->topic == Topic::kStatus) return 0;
  return failed(9, "core: the robot does not say that it has the tile");
}

int beRobot(Link& link, int keyframes) {
  if (!awaitPeer(link)) return failed(5, "robot: no core found " + link.trouble());
  if (auto sent = link.publish(Topic::kHello, "a", {}); !sent) return failed(6, "robot: " + sent.error().text);
  for (int i = 0; i < keyframes; ++i)
    if (auto sent = link.publish(Topic::kKeyframe, "a", patternOf(300000)); !sent)
      return failed(7, "robot: " + sent.error().text);
  bool tile = false, acknowledged = false;
  while (!tile || !acknowledged) {
    const auto delivery = link.receive(30s);
    if (!delivery) return failed(8, std::string("robot: no ") + (tile ? "acknowledgement" : "tile") + " came");
    if (delivery->topic == Topic::kTile && delivery->payload != patternOf(500000))
      return failed(9, "robot: a tile of other bytes than were sent");
    tile = tile || delivery->topic == Topic::kTile;
    acknowledged = acknowledged || (delivery->topic == Topic::kAck && delivery->payload.front() == keyframes);
  }
  if (auto sent = link.publish(Topic::kStatus, "a", {}); !sent) return failed(10, "robot: " + sent.error().text);
  return awaitDelivery(link, Topic::kStatus) ? 0 : failed(11, "robot: the core does not take its last word");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 7) return 2;
  const bool core = std::string(argv[1]) == "core";
  DdsLinkOptions options;
  options.site = "apart";
  options.role = core ? LinkRole::kCore : LinkRole::kRobot;
  options.robot = core ? "" : "a";
  options.interface_address = argv[2];
  options.profile = argv[3];
  const std::string known = argv[4];
  if (known != "-") (known.find(':') == std::string::npos ? options.core_address : options.discovery_server) = known;
  if (std::string(argv[5]) != "-") options.keys = argv[5];
  options.insecure = options.keys.empty();
  options.notice = [](const std::string& text) { std::fprintf(stderr, "%s\n", text.c_str()); };
  auto link = connectDds(options);
  if (!link) {
    std::fprintf(stderr, "%s\n", link.error().text.c_str());
    return 3;
  }
  const int keyframes = std::atoi(argv[6]);
  return core ? beCore(**link, keyframes) : beRobot(**link, keyframes);
}
