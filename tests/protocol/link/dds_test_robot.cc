// The other end of dds_link_test, in a process of its own: a robot that sends keyframes and waits for its answers.
// Arguments: domain, number of keyframes. Exit code 0 if all came back, else the step that failed.
#include <chrono>
#include <cstdlib>
#include <set>
#include <thread>

#include "protocol/link/dds_link.h"

int main(int argc, char** argv) {
  using namespace comap;
  using namespace std::chrono_literals;
  if (argc != 3) return 2;
  auto connected = connectDds({std::atoi(argv[1]), "two-processes", LinkRole::kRobot, "far", "127.0.0.1"});
  if (!connected) return 3;
  Link& link = **connected;
  for (int i = 0; link.peers() == 0; ++i) {
    if (i == 400) return 4;
    std::this_thread::sleep_for(50ms);
  }
  if (!link.publish(Topic::kHello, "far", std::vector<uint8_t>(10, 1))) return 5;
  const int keyframes = std::atoi(argv[2]);
  for (int i = 0; i < keyframes; ++i) {
    if (!link.publish(Topic::kKeyframe, "far", std::vector<uint8_t>(300000, static_cast<uint8_t>(i)))) return 6;
  }
  // The core acknowledges the last keyframe, and sends a correction and a tile: only then is all of it through.
  std::set<Topic> got;
  while (got.size() < 3) {
    const auto delivery = link.receive(30s);
    if (!delivery) return 7;
    if (delivery->robot != "far") return 8;
    got.insert(delivery->topic);
  }
  return 0;
}
