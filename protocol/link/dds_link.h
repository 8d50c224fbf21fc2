// The wire over DDS: comap's topics on one domain, in the partitions of one site.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "protocol/link/link.h"
#include "protocol/types/result.h"

namespace comap {

struct DdsLinkOptions {
  int domain = 42;               ///< 0..230; robots and core of a site share it
  std::string site = "default";  ///< DDS partition: sites on one domain do not hear each other
  LinkRole role = LinkRole::kRobot;
  std::string robot;  ///< a robot's own name, or that of an observer who asks for tiles; unused by others
  /// The one interface to use: its IPv4 address, or its name ("wlan0"), whose address may then come, go and change.
  /// 127.*: nothing leaves the machine.
  std::string interface_address = "127.0.0.1";
  /// "local": one machine, large datagrams. "lan": datagrams that need no IP fragments, discovery by multicast on the
  /// interface. "wan": as lan, but without multicast: robots are told an address. "auto": local on 127.*, else lan.
  std::string profile = "auto";
  std::string core_address = {};  ///< wan, robots and observers: IPv4 address of the core
  /// HOST or HOST:PORT of a discovery server; then there is no multicast, whatever the profile. Without an answer it is
  /// tried for ever, and the link is there and has no peers.
  std::string discovery_server = {};
  int max_blocking_ms = 10000;  ///< that publish waits for room among keyframes that nobody takes
  /// Folder of this participant's keys, as `fleet keys` makes it; messages are then encrypted and each is from whom it
  /// says. Empty: clear text.
  std::string keys = {};
  /// Without keys, another interface than 127.* needs this word that the network is trusted.
  bool insecure = false;
  /// Told, from other threads, what is worth a log line: who was not let in, and why.
  std::function<void(const std::string&)> notice = {};
};

/// All that connectDds() refuses before it opens anything: options out of range, an interface that is not there, keys
/// of someone else or that do not count.
Result<void> checkDdsOptions(const DdsLinkOptions& options);

/// kWrongUse for options out of range, kBadData for keys that will not do (in a sentence), kUnreachable if the
/// interface is not there or the domain's ports are taken. With the name of an interface that has no address yet, the
/// link is there and has no peers. publish blocks up to max_blocking_ms while a keyframe reader takes nothing, then
/// kUnreachable. Messages wait in DDS until receive takes them, so a reader that stops stops its writers and does not
/// grow. Closing takes well under a second.
Result<std::unique_ptr<Link>> connectDds(const DdsLinkOptions& options);

}  // namespace comap
