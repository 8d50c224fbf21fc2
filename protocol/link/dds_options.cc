#include "protocol/link/dds_options.h"

#include <net/if.h>

#include "protocol/discovery/endpoint.h"
#include "protocol/link/roaming_link.h"
#include "protocol/link/security.h"
#include "protocol/types/ids.h"

namespace comap {
namespace {

constexpr int kMaxDomain = 230;  // beyond, the standard's port numbers pass 65535

Result<void> checkProfile(const DdsLinkOptions& options) {
  const std::string profile = profileOf(options);
  if (profile != "local" && profile != "lan" && profile != "wan")
    return Error{ErrorCode::kWrongUse, "link.profile '" + profile + "', expected auto, local, lan or wan"};
  if (profile == "local" && !options.interface_address.starts_with("127."))
    return Error{ErrorCode::kWrongUse, "link.profile local stays on this machine, but link.interface_address is '" +
                                           options.interface_address + "': expected 127.0.0.1, or profile lan or wan"};
  if (!options.core_address.empty() && !parseAddress(options.core_address))
    return Error{ErrorCode::kWrongUse, "link.core_address '" + options.core_address + "' is no IPv4 address"};
  if (!options.discovery_server.empty())
    if (auto parsed = parseHostPort(options.discovery_server, "link.discovery_server"); !parsed) return parsed.error();
  if (profile == "wan" && options.role != LinkRole::kCore && options.core_address.empty() &&
      options.discovery_server.empty())
    return Error{ErrorCode::kWrongUse,
                 "link.profile wan has no multicast: link.core_address must name the core, or link.discovery_server a "
                 "discovery server"};
  return {};
}

}  // namespace

std::string profileOf(const DdsLinkOptions& options) {
  if (options.profile != "auto") return options.profile;
  return options.interface_address.starts_with("127.") ? "local" : "lan";
}

Error unreachable(const DdsLinkOptions& options, const std::string& what) {
  return {ErrorCode::kUnreachable,
          what + " on DDS domain " + std::to_string(options.domain) + " at " + options.interface_address + " failed"};
}

Result<void> checkDdsOptions(const DdsLinkOptions& options) {
  if (options.domain < 0 || options.domain > kMaxDomain) {
    return Error{ErrorCode::kWrongUse,
                 "link.domain is " + std::to_string(options.domain) + ", expected 0 to " + std::to_string(kMaxDomain)};
  }
  if (options.site.empty() || options.site.size() > 64 || options.site.find_first_of("*?[]\\/") != std::string::npos) {
    return Error{ErrorCode::kWrongUse, "link.site '" + options.site.substr(0, 64) +
                                           "' is no site, expected 1-64 characters without * ? [ ] \\ /"};
  }
  if (options.role == LinkRole::kRobot || (options.role == LinkRole::kObserver && !options.robot.empty())) {
    if (const std::string problem = robotNameProblem(options.robot); !problem.empty()) {
      return Error{ErrorCode::kWrongUse, problem};
    }
  }
  if (auto checked = checkProfile(options); !checked) return checked.error();
  const bool by_name = if_nametoindex(options.interface_address.c_str()) != 0;
  if (!by_name && ownAddress(options.interface_address).empty()) {
    return Error{ErrorCode::kUnreachable, "link.interface_address '" + options.interface_address +
                                              "' is no IPv4 address or network interface of this machine that is up"};
  }
  if (options.keys.empty() && !options.insecure && options.interface_address.rfind("127.", 0) != 0)
    return Error{ErrorCode::kWrongUse,
                 "link.interface_address '" + options.interface_address +
                     "' leaves this machine and messages are not encrypted: make keys with 'fleet keys' and give them "
                     "with --keys or link.keys; or, if that network is trusted, say so with --insecure or "
                     "link.insecure: true"};
  return checkKeys(options);
}

}  // namespace comap
