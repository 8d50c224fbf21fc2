#include "mapping_core/service/core_config.h"

#include <spdlog/fmt/fmt.h>

#include "mapping_core/gpu/device_choice.h"
#include "protocol/config/config_reader.h"
#include "protocol/config/yaml_text.h"

namespace comap {
namespace {

constexpr uint32_t kLeastMemory_mb = 256;  // what one keyframe sees of a close map, and where its new surfels go

}  // namespace

Result<CoreConfig> readCoreConfig(const std::string& path) {
  auto reader = ConfigReader::fromFile(path);
  if (!reader) return reader.error();
  CoreConfig config;
  MapBuilderOptions& mapping = config.service.mapping;
  reader->read("store", config.store);
  reader->read("device", config.device);
  if (const std::string problem = gpu::choiceProblem(config.device); !problem.empty())
    reader->complain("device", problem);
  reader->read("hurry_from_waiting", config.service.hurry_from_waiting, 0, 1000000);
  reader->read("half_detail_from_load", config.service.half_detail_from_load, 0, 1000);

  ConfigReader link = reader->section("link");
  link.read("domain", config.link.domain, 0, 230);
  link.read("site", config.link.site);
  link.read("interface_address", config.link.interface_address);
  link.read("profile", config.link.profile, {"auto", "local", "lan", "wan"});
  link.read("discovery_server", config.link.discovery_server);
  link.read("serve_discovery", config.serve_discovery, 0, 65535);
  if (config.serve_discovery > 0 && !config.link.discovery_server.empty())
    link.complain("serve_discovery", "the core is its own discovery server then: leave discovery_server empty");
  link.read("keys", config.link.keys);
  link.read("insecure", config.link.insecure);

  ConfigReader fusion = reader->section("fusion");
  fusion.read("depth_min_m", mapping.fusion.depth_min_m, 0.05, 2);
  fusion.read("depth_max_m", mapping.fusion.depth_max_m, 0.5, 13);
  if (mapping.fusion.depth_min_m >= mapping.fusion.depth_max_m)
    fusion.complain("depth_max_m", fmt::format("is {}, expected more than depth_min_m, {}", mapping.fusion.depth_max_m,
                                               mapping.fusion.depth_min_m));
  fusion.read("stable_confidence", mapping.fusion.stable_confidence, 0, 100);
  fusion.read("averaging_limit", mapping.fusion.averaging_limit, 1, 1000);
  fusion.read("memory_mb", mapping.fusion.memory_mb, 0, 1u << 20);
  if (mapping.fusion.memory_mb > 0 && mapping.fusion.memory_mb < kLeastMemory_mb)
    fusion.complain("memory_mb", fmt::format("is {}, expected 0 (what the device gives) or {} at least: all that one "
                                             "keyframe sees must fit",
                                             mapping.fusion.memory_mb, kLeastMemory_mb));

  ConfigReader matching = reader->section("matching");
  uint32_t candidates = static_cast<uint32_t>(mapping.search.candidates);
  uint32_t loops = static_cast<uint32_t>(mapping.search.loop_candidates);
  uint32_t votes = static_cast<uint32_t>(mapping.vote.needed);
  uint32_t witnesses = static_cast<uint32_t>(mapping.probation.witnesses);
  matching.read("candidates", candidates, 0, 100);
  matching.read("loop_candidates", loops, 0, 100);
  matching.read("max_dissimilarity", mapping.search.max_dissimilarity, 0, 1);
  matching.read("inlier_ratio", mapping.verifier.inlier_ratio, 0, 1);
  matching.read("overlap", mapping.verifier.overlap, 0, 1);
  matching.read("rms_sigma", mapping.verifier.rms_sigma, 0.1, 10);
  matching.read("degeneracy", mapping.verifier.degeneracy, 0, 1);
  matching.read("photometric_median", mapping.verifier.photometric_median, 1, 255);
  matching.read("seen_through", mapping.verifier.seen_through, 0, 1);
  matching.read("unlike", mapping.verifier.unlike, 0, 1);
  matching.read("features", mapping.verifier.features, 0, 1);
  matching.read("votes", votes, 1, 20);
  matching.read("witnesses", witnesses, 0, 10000);
  mapping.search.candidates = candidates;
  mapping.search.loop_candidates = loops;
  mapping.vote.needed = votes;
  mapping.probation.witnesses = witnesses;

  reader->section("ferns").read("seed", config.service.mapping.fern_seed);

  ConfigReader tiles = reader->section("tiles");
  tiles.read("every_keyframes", config.service.tile_every_keyframes, 1, 10000);
  tiles.read("spacing_m", config.service.tile_spacing_m, 0.002, 0.5);
  readTelemetryOptions(*reader, config.telemetry);
  ros2::readRos2Options(*reader, config.ros2);
  if (auto finished = reader->finish(); !finished) return finished.error();
  return config;
}

std::string printCoreConfig(const CoreConfig& c) {
  const MapBuilderOptions& m = c.service.mapping;
  return fmt::format(
             R"(# The mapping core. Every key is optional; these are the values in force.
store: {}              # file of the map store
device: {}             # Vulkan device: auto, llvmpipe or a number of mapping_core --list-devices
hurry_from_waiting: {}  # keyframes: from so many on, one is fused at half size and its loops looked for later. 0: never
half_detail_from_load: {}  # share of the core's time: if keyframes need that much, they are fused at half size. 0: never
link:
  domain: {}             # DDS domain, 0..230; the same as the robots'
  site: {}             # robots of this site are served
  interface_address: {}  # the one network interface to use: its IPv4 address, or its name
  profile: {}          # local: this machine; lan: small datagrams; wan: no multicast; auto: local on 127.*, else lan
  discovery_server: {} # HOST or HOST:PORT, for networks without multicast; empty: none
  serve_discovery: {}      # be one on this UDP port (7399 is usual); 0: no
  keys: {}             # folder made by fleet keys: messages are encrypted; empty: clear text
  insecure: {}         # true: clear text on an interface other than loopback
fusion:
  depth_min_m: {}
  depth_max_m: {}
  stable_confidence: {}  # surfels below are not shown
  averaging_limit: {}    # confidence counts no more than this in the running average
  memory_mb: {}            # for surfels on the device, 256 at least; more of them wait in a file. 0: what it gives
matching:                # when two keyframes see the same place
  candidates: {}         # fern candidates a keyframe in other maps
  loop_candidates: {}    # and in its own
  max_dissimilarity: {}  # of fern codes
  inlier_ratio: {}       # at least
  overlap: {}            # at least
  rms_sigma: {}          # at most
  degeneracy: {}         # at least
  photometric_median: {}  # grey levels, at most
  seen_through: {}       # share of pixels, at most
  unlike: {}             # share of textured patches that do not look alike, at most
  features: {}           # share of patches with something on them, at least
  votes: {}              # closures that must agree before two maps become one
  witnesses: {}          # later keyframes that must confirm it; until then what contradicts it undoes it
ferns:
  seed: {}            # of the book of place codes; the same as the robots'
tiles:
  every_keyframes: {}    # renewed after so many, and when the core is idle
  spacing_m: {}          # level of detail that goes to robots
)",
             yamlText(c.store), yamlText(c.device), c.service.hurry_from_waiting, c.service.half_detail_from_load,
             c.link.domain, yamlText(c.link.site), yamlText(c.link.interface_address), c.link.profile,
             yamlText(c.link.discovery_server), c.serve_discovery, yamlText(c.link.keys), c.link.insecure,
             m.fusion.depth_min_m, m.fusion.depth_max_m, m.fusion.stable_confidence, m.fusion.averaging_limit,
             m.fusion.memory_mb, m.search.candidates, m.search.loop_candidates, m.search.max_dissimilarity,
             m.verifier.inlier_ratio, m.verifier.overlap, m.verifier.rms_sigma, m.verifier.degeneracy,
             m.verifier.photometric_median, m.verifier.seen_through, m.verifier.unlike, m.verifier.features,
             m.vote.needed, m.probation.witnesses, m.fern_seed, c.service.tile_every_keyframes,
             c.service.tile_spacing_m) +
         printTelemetryOptions(c.telemetry) + ros2::printRos2Options(c.ros2);
}

}  // namespace comap
