// One end of a link, in a process (and network) of its own: a robot that sends keyframes, or a core that answers them.
//   dds_peer core|robot INTERFACE PROFILE CORE_ADDRESS|DISCOVERY:PORT|- KEYS|- KEYFRAMES
// Every payload repeats a known pattern. Exit code 0 if all came, whole, and was answered; else the step that failed.
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

bool awaitPeer(const Link& link) {
  for (int i = 0; i < 600 && link.peers() == 0; ++i) std::this_thread::sleep_for(50ms);
  return link.peers() > 0;
}

int beCore(Link& link, int keyframes) {
  for (int got = 0; got < keyframes;) {
    const auto delivery = link.receive(30s);
    if (!delivery) return 5;
    if (delivery->topic != Topic::kKeyframe) continue;
    if (delivery->payload != patternOf(300000)) return 6;
    ++got;
    if (!link.publish(Topic::kAck, "a", std::vector<uint8_t>{static_cast<uint8_t>(got)})) return 7;
  }
  if (!link.publish(Topic::kTile, "a", patternOf(500000))) return 8;
  // Until the robot says that it has it.
  while (const auto delivery = link.receive(30s))
    if (delivery->topic == Topic::kStatus) return 0;
  return 9;
}

int beRobot(Link& link, int keyframes) {
  if (!awaitPeer(link)) return 5;
  if (!link.publish(Topic::kHello, "a", {})) return 6;
  for (int i = 0; i < keyframes; ++i)
    if (!link.publish(Topic::kKeyframe, "a", patternOf(300000))) return 7;
  bool tile = false, acknowledged = false;
  while (!tile || !acknowledged) {
    const auto delivery = link.receive(30s);
    if (!delivery) return 8;
    if (delivery->topic == Topic::kTile && delivery->payload != patternOf(500000)) return 9;
    tile = tile || delivery->topic == Topic::kTile;
    acknowledged = acknowledged || (delivery->topic == Topic::kAck && delivery->payload.front() == keyframes);
  }
  if (!link.publish(Topic::kStatus, "a", {})) return 10;
  std::this_thread::sleep_for(2s);  // until the core has it
  return 0;
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
