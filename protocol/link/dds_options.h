// What a link over DDS is opened with.
#pragma once

#include <functional>
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
  /// The list of revoked certificates to go by instead of the one in `keys`; the link sets it by itself.
  std::string revoked = {};
  /// When this core began (core_watch.h); the link sets it by itself.
  std::string began = {};
  /// Without keys, another interface than 127.* needs this word that the network is trusted.
  bool insecure = false;
  /// Told, from other threads, what is worth a log line: who was not let in, and why.
  std::function<void(const std::string&)> notice = {};
};

/// All that connectDds() refuses before it opens anything: options out of range, an interface that is not there, keys
/// of someone else or that do not count.
Result<void> checkDdsOptions(const DdsLinkOptions& options);

/// The profile of `options`, "auto" resolved.
std::string profileOf(const DdsLinkOptions& options);

/// kUnreachable: DDS did not do `what`; says on which domain and interface.
Error unreachable(const DdsLinkOptions& options, const std::string& what);

}  // namespace comap
