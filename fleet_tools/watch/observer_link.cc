#include "fleet_tools/watch/observer_link.h"

#include <unistd.h>

#include <cstdio>
#include <ctime>

#include "protocol/keys/credentials.h"

namespace comap {
namespace {

// Few names, as the core keeps a writer for each that ever asked; two viewers of one name only get more than they need.
constexpr int kNames = 16;

}  // namespace

void addObserverOptions(CLI::App& verb, DdsLinkOptions& options) {
  options.role = LinkRole::kObserver;
  options.notice = [](const std::string& line) { std::fprintf(stderr, "fleet: %s\n", line.c_str()); };
  verb.add_option("--site", options.site, "Site to listen to")->capture_default_str();
  verb.add_option("--domain", options.domain, "DDS domain")->check(CLI::Range(0, 230))->capture_default_str();
  verb.add_option("--interface", options.interface_address, "Network interface to use: its IPv4 address, or its name")
      ->capture_default_str();
  verb.add_option("--core", options.core_address, "IPv4 address of the core, for networks without multicast")
      ->each([&options](const std::string&) { options.profile = "wan"; });
  verb.add_option("--discovery", options.discovery_server,
                  "HOST or HOST:PORT of a discovery server, for networks without multicast");
  verb.add_option("--keys", options.keys, "Folder of a tool's keys, made by fleet keys");
  verb.add_flag("--insecure", options.insecure, "Allow clear text on an interface other than loopback");
}

Result<std::unique_ptr<Link>> connectObserver(DdsLinkOptions options, bool asks_for_tiles, std::string& name) {
  name.clear();
  if (asks_for_tiles && options.keys.empty()) name = "view-" + std::to_string(getpid() % kNames);
  if (asks_for_tiles && !options.keys.empty()) {
    const auto owner = checkCredentials(credentialsIn(options.keys), std::time(nullptr));
    if (!owner) return Error{owner.error().code, "--keys: " + owner.error().text};
    name = owner->name;
  }
  options.robot = name;
  return connectDds(options);
}

}  // namespace comap
