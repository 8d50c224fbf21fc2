// The mapping core: takes the keyframes of all robots of a site and makes one map of them.
#include <signal.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <new>
#include <optional>
#include <thread>

#include "mapping_core/gpu/device_choice.h"
#include "mapping_core/service/core_config.h"
#include "mapping_core/service/core_metrics.h"
#include "mapping_core/service/core_report.h"
#include "mapping_core/service/ros2_map.h"
#include "mapping_core/store/store_log.h"
#include "mapping_core/store/store_remedy.h"
#include "protocol/discovery/discovery_server.h"
#include "protocol/link/dds_link.h"
#include "protocol/program/out_of_memory.h"
#include "protocol/program/service_arguments.h"
#include "protocol/program/standard_output.h"
#include "protocol/telemetry/stage_clock.h"
#include "protocol/types/whole_file.h"

namespace comap {
namespace {

volatile sig_atomic_t g_stop = 0;

struct Arguments : ServiceArguments {
  std::string store, device;
  int serve_discovery = -1;  // not given
  bool list_devices = false;
};

int failWith(const Error& error, const Log& log) {
  log.error(error.text);
  return exitCodeOf(error.code);
}

int listDevices(const Log& log) {
  const auto devices = gpu::listDevices();
  if (!devices) return failWith(devices.error(), log);
  for (const gpu::DeviceInfo& device : *devices)
    std::printf("%u  %s (%s)%s%s\n", device.index, device.name.c_str(), device.type.c_str(),
                device.refusal.empty() ? "" : ": cannot be used: ", device.refusal.c_str());
  return 0;
}

Result<CoreConfig> configure(const Arguments& arguments) {
  CoreConfig config;
  if (!arguments.config.empty()) {
    auto read = readCoreConfig(arguments.config);
    if (!read) return read.error();
    config = std::move(*read);
  }
  if (!arguments.store.empty()) config.store = arguments.store;
  if (!arguments.device.empty()) config.device = arguments.device;
  if (const std::string problem = gpu::choiceProblem(config.device); !problem.empty())
    return Error{ErrorCode::kWrongUse, "--device: " + problem};
  if (arguments.serve_discovery >= 0) config.serve_discovery = arguments.serve_discovery;
  config.link.role = LinkRole::kCore;
  if (auto applied = apply(arguments, "mapping_core", "", config.link, config.telemetry, config.ros2); !applied)
    return applied.error();
  if (config.serve_discovery > 0 && !config.link.discovery_server.empty())
    return Error{ErrorCode::kWrongUse,
                 "link.discovery_server is '" + config.link.discovery_server +
                     "', but link.serve_discovery makes the core its own discovery server: give one of them"};
  return config;
}

// The core's own discovery server, if it is to be one; the link is then told to use it.
Result<std::unique_ptr<DiscoveryServer>> serveDiscovery(int port, DdsLinkOptions& link, const Log& log) {
  if (port == 0) return std::unique_ptr<DiscoveryServer>();
  const Endpoint everywhere{0, static_cast<uint16_t>(port), 0}, here{0x7f000001, static_cast<uint16_t>(port), 0};
  auto server = DiscoveryServer::start(link.interface_address.starts_with("127.") ? here : everywhere,
                                       [log](const std::string& line) { log.info("discovery: " + line); });
  if (server) link.discovery_server = toString(here);
  return server;
}

// Two cores of one site would both take every keyframe and contradict each other's corrections: one gives way.
Result<void> checkAlone(const Link& link, const CoreConfig& config) {
  const std::string elder = link.elder();
  if (elder.empty()) return {};
  return Error{ErrorCode::kUnreachable,
               "site '" + config.link.site + "' on DDS domain " + std::to_string(config.link.domain) +
                   " is served by " + elder +
                   ": this one gives way and ends. What it has acknowledged is in its "
                   "store; robots keep everything else for the other. To have this one instead stop the other, or "
                   "choose another --core-site or --domain"};
}

// Before anything is taken from a robot. Participants announce themselves every 2 s, and may miss a newcomer's word.
Result<void> listenForOthers(const Link& link, const CoreConfig& config) {
  constexpr std::chrono::milliseconds kListen(2500), kListenIfUnclear(6000), kStep(20);
  for (auto waited = kStep; g_stop == 0; waited += kStep) {
    if (auto alone = checkAlone(link, config); !alone) return alone;
    if (waited > (link.knowsCores() ? kListen : kListenIfUnclear)) break;
    std::this_thread::sleep_for(kStep);
  }
  return {};
}

Result<void> serve(MappingService& service, Link& link, const CoreConfig& config, Telemetry& telemetry,
                   std::optional<Ros2Map>& ros2, const std::string& device) {
  constexpr int kFinish_s = 600;
  link.serve();
  const auto tell = [&](bool ready) { telemetry.tell(kCoreMetrics, [&] { return reportOf(service, device, ready); }); };
  while (g_stop == 0) {
    tell(true);
    if (auto alone = checkAlone(link, config); !alone) return alone;
    if (ros2) ros2->follow(service.tiles(), std::chrono::steady_clock::now());
    const auto worked = service.step(std::chrono::milliseconds(200));
    if (!worked) return worked.error();
    if (!*worked || service.quiet())
      if (auto refreshed = service.refreshTiles(); !refreshed) return refreshed;
  }
  telemetry.stopping(kFinish_s);
  tell(false);
  return service.finish([&](size_t, size_t) { tell(false); });
}

int run(const Arguments& arguments, const Log& early) {
  auto config = configure(arguments);
  if (!config) return failWith(config.error(), early);
  const Log log = makeLog(config->telemetry, "mapping_core");
  const auto failWith = [&](const Error& error) { return comap::failWith(error, log); };
  if (arguments.print_config) {
    std::printf("%s", printCoreConfig(*config).c_str());
    return 0;
  }
  if (arguments.check_config) {
    const auto keys = checkKeysOf(config->link);
    return keys ? 0 : failWith(keys.error());
  }
  if (arguments.health) return askHealth(config->telemetry, log);
  if (auto writable = checkWritable(arguments.report, FileKind::kJson); !writable) return failWith(writable.error());
  if (auto free = StageClock::checkTrace(config->telemetry.trace); !free) return failWith(free.error());
  if (auto checked = checkDdsOptions(config->link); !checked) return failWith(checked.error());
  const auto discovery = serveDiscovery(config->serve_discovery, config->link, log);
  if (!discovery) return failWith(discovery.error());
  auto link = connectDds(config->link);
  if (!link) return failWith(link.error());
  if (auto alone = listenForOthers(**link, *config); !alone) return failWith(alone.error());
  auto telemetry = Telemetry::start(config->telemetry);
  if (!telemetry) return failWith(telemetry.error());
  gpu::DeviceOptions device_options;
  device_options.choice = config->device;
  device_options.cache_directory = gpu::defaultCacheDirectory();
  auto device = gpu::Device::create(device_options);
  if (!device) return failWith(device.error());
  const LogEnd log_end = lookAtLog(config->store);
  auto store = MapStore::open(config->store, MapStore::Mode::kCreateOrOpen);
  if (!store) return failWith(withRemedy(store.error(), config->store));
  if (!log_end.damage.empty()) log.error(config->store + ": " + log_end.damage);
  if (!log_end.remark.empty()) log.info(config->store + ": " + log_end.remark);
  std::optional<Ros2Map> ros2;
  if (config->ros2.enabled) {
    auto started = Ros2Map::start(config->ros2, config->link.domain);
    if (!started) return failWith(started.error());
    ros2.emplace(std::move(*started));
  }
  log.info("mapping core on " + device->info().name + ", site " + config->link.site + ", DDS domain " +
           std::to_string(config->link.domain) + ", store " + config->store);
  MappingService service(config->service, **link, *store, *device,
                         [&](LogLevel level, const std::string& line) { log.write(level, line); });
  if (auto resumed = service.resume(); !resumed) return failWith(withRemedy(resumed.error(), config->store));
  if (auto served = serve(service, **link, *config, *telemetry, ros2, device->info().name); !served)
    return failWith(withRemedy(served.error(), config->store));
  if (auto traced = telemetry->finish(); !traced) return failWith(traced.error());
  if (!arguments.report.empty())
    if (auto written = writeCoreReport(reportOf(service, device->info().name), arguments.report); !written)
      return failWith(written.error());
  return 0;
}

}  // namespace
}  // namespace comap

int main(int argc, char** argv) {
  comap::failOnLostOutput("mapping_core");
  comap::Arguments arguments;
  CLI::App app("The mapping core: takes the keyframes of all robots of a site and makes one dense map of them.",
               "mapping_core");
  app.footer(
      "Example: mapping_core --store flat.comap --device llvmpipe\n"
      "It maps until it gets SIGINT or SIGTERM, then completes the store and ends.\n"
      "Exit codes: 0 ok, 1 problem found, 2 wrong use, 3 cannot reach or read.");
  comap::addServiceOptions(app, arguments, "Site whose robots are served",
                           "Publish the map for ROS 2 programs: /fleet/map");
  app.add_option("--store", arguments.store, "File of the map store, made if it is not there");
  app.add_option("--serve-discovery", arguments.serve_discovery,
                 "Be the discovery server of the site, on this UDP port (7399 is usual); 0: no")
      ->check(CLI::Range(0, 65535));
  app.add_option("--device", arguments.device, "Vulkan device: auto, llvmpipe or a number of --list-devices");
  app.add_flag("--list-devices", arguments.list_devices, "Print the Vulkan devices, usable or why not, and stop");
  app.set_version_flag("--version", "mapping_core " COMAP_VERSION);
  const comap::Log log = comap::earlyLog(argc, argv, "mapping_core");
  if (const auto ended = comap::parse(app, argc, argv, log)) return *ended;
  struct sigaction action {};
  action.sa_handler = [](int) { comap::g_stop = 1; };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  signal(SIGXFSZ, SIG_IGN);  // a store beyond its limit is an error like a full disk
  comap::tellWhenOutOfMemory("mapping_core",
                             "a smaller fusion.memory_mb needs less, and so do fewer robots; all that was acknowledged "
                             "is in the store");
  try {
    return arguments.list_devices ? comap::listDevices(log) : comap::run(arguments, log);
  } catch (const std::bad_alloc&) {
    return comap::exitCodeOf(comap::ErrorCode::kOutOfMemory);  // it was told
  }
}
