// The wire over DDS: comap's topics on one domain, in the partition of one site.
#pragma once

#include <memory>
#include <string>

#include "protocol/link/link.h"
#include "protocol/types/result.h"

namespace comap {

struct DdsLinkOptions {
  int domain = 42;               ///< 0..230; robots and core of a site share it
  std::string site = "default";  ///< DDS partition: sites on one domain do not hear each other
  LinkRole role = LinkRole::kRobot;
  std::string robot;  ///< a robot's own name; unused by others
  /// IPv4 address of the one interface to use. 127.*: nothing leaves the machine.
  std::string interface_address = "127.0.0.1";
  /// Messages are not encrypted: another interface than 127.* needs this word that the network is trusted.
  bool insecure = false;
};

/// kWrongUse for options out of range, kUnreachable if the interface is not there or the domain's ports are taken.
/// publish blocks up to 10 s while a keyframe reader takes nothing, then kUnreachable. Messages wait in DDS until
/// receive takes them, so a reader that stops stops its writers and does not grow.
/// Closing takes well under a second.
Result<std::unique_ptr<Link>> connectDds(const DdsLinkOptions& options);

}  // namespace comap
