// Says hello over the loopback link and reads it back: types, encoding and link of the installed library.
#include <cstdio>

#include "protocol/codec/codec.h"
#include "protocol/link/loopback_link.h"

int main() {
  comap::LoopbackHub hub;
  auto core = hub.connect(comap::LinkRole::kCore, "");
  auto robot = hub.connect(comap::LinkRole::kRobot, "a");
  const auto encoded = comap::encodeHello({"a", 7, 42, "1"});
  if (!encoded || !robot->publish(comap::Topic::kHello, "a", *encoded)) return 1;
  const auto delivery = core->receive(std::chrono::milliseconds(1000));
  if (!delivery) return 1;
  const auto hello = comap::decodeHello(delivery->payload);
  if (!hello || hello->robot != "a" || hello->session != 7) return 1;
  std::printf("robot %s of session %llu says hello\n", hello->robot.c_str(),
              static_cast<unsigned long long>(hello->session));
}
