#include <signal.h>

#include <cstdio>
#include <ctime>
#include <memory>
#include <string>

#include "fleet_tools/command_line/fail.h"
#include "fleet_tools/command_line/verb.h"
#include "protocol/discovery/discovery_ask.h"
#include "protocol/discovery/discovery_server.h"

namespace comap {
namespace {

struct DiscoveryArguments {
  std::string listen = "0.0.0.0", ask, site = "default";
  int domain = 42;
};

int ask(const DiscoveryArguments& arguments) {
  const auto counts = askDiscovery(arguments.ask, arguments.domain, arguments.site, std::chrono::seconds(2));
  if (!counts) return failWith(counts.error());
  std::printf("%s answers; of site %s, domain %d: %d cores, %d robots, %d observers; of all sites: %d\n",
              arguments.ask.c_str(), arguments.site.c_str(), arguments.domain, counts->cores, counts->robots,
              counts->observers, counts->all);
  return 0;
}

int serve(const DiscoveryArguments& arguments) {
  const auto parsed = parseHostPort(arguments.listen, "--listen");
  if (!parsed) return failWith(parsed.error());
  const auto address = parseAddress(parsed->host);
  if (!address)
    return failWith(
        {ErrorCode::kWrongUse, "--listen '" + arguments.listen + "': expected an IPv4 address of this machine"});
  // Blocked before the server's thread begins, which inherits it: they come to sigwait alone.
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  const auto server = DiscoveryServer::start({*address, parsed->port, 0}, [](const std::string& line) {
    std::fprintf(stderr, "fleet discovery: %s\n", line.c_str());
  });
  if (!server) return failWith(server.error());
  std::fprintf(stderr, "fleet discovery: serves at %s\n", toString({*address, (*server)->port(), 0}).c_str());
  int signal = 0;
  sigwait(&signals, &signal);
  return 0;
}

}  // namespace

void addDiscoveryVerb(CLI::App& app, int& exit_code) {
  auto* verb = app.add_subcommand("discovery",
                                  "Serve as the one address that core and robots know, on networks without multicast");
  verb->footer(
      "Example: fleet discovery\n"
      "         mapping_core --discovery 10.0.0.1 --interface eth0 --keys core --core-site flat\n"
      "         edge_agent --discovery 10.0.0.1 --interface wlan0 --keys a --core-site flat --robot a --source ...\n"
      "It tells those who announce themselves of each other; all else goes directly between them. It needs no keys "
      "and\n"
      "serves any number of sites. mapping_core --serve-discovery 7399 does the same inside the core.");
  auto arguments = std::make_shared<DiscoveryArguments>();
  verb->add_option("--listen", arguments->listen, "ADDRESS or ADDRESS:PORT to listen on")->capture_default_str();
  auto* ask_option =
      verb->add_option("--ask", arguments->ask, "Ask the server at HOST or HOST:PORT who is there, and stop");
  verb->add_option("--site", arguments->site, "With --ask: which site")->needs(ask_option)->capture_default_str();
  verb->add_option("--domain", arguments->domain, "With --ask: its DDS domain")
      ->needs(ask_option)
      ->check(CLI::Range(0, 230))
      ->capture_default_str();
  verb->callback([arguments, &exit_code] { exit_code = arguments->ask.empty() ? serve(*arguments) : ask(*arguments); });
}

}  // namespace comap
