#include "edge_agent/agent_config.h"

#include <spdlog/fmt/fmt.h>

#include "protocol/config/config_reader.h"
#include "protocol/config/yaml_text.h"

namespace comap {

namespace {

constexpr uint32_t kUnlimited_mb = 4'000'000'000;  // written as 0

}  // namespace

Result<AgentConfig> readAgentConfig(const std::string& path) {
  auto reader = ConfigReader::fromFile(path);
  if (!reader) return reader.error();
  AgentConfig config;
  reader->read("robot", config.robot);
  if (const std::string problem = robotNameProblem(config.robot); !problem.empty()) reader->complain("robot", problem);
  reader->read("source", config.source);
  readCameraConfig(reader->section("camera"), config.camera);
  if (const CameraProfile* profile = config.camera.builtIn())
    config.odometry.alignment.noise = {profile->noise_floor_m, profile->noise_factor_per_m};

  ConfigReader link = reader->section("link");
  link.read("domain", config.link.domain, 0, 230);
  link.read("site", config.link.site);
  link.read("interface_address", config.link.interface_address);
  link.read("profile", config.link.profile, {"auto", "local", "lan", "wan"});
  link.read("core_address", config.link.core_address);
  link.read("discovery_server", config.link.discovery_server);
  link.read("keys", config.link.keys);
  link.read("insecure", config.link.insecure);

  ConfigReader odometry = reader->section("odometry");
  odometry.read("depth_min_m", config.odometry.depth_min_m, 0.05, 2);
  odometry.read("depth_max_m", config.odometry.depth_max_m, 0.5, 13);
  if (config.odometry.depth_min_m >= config.odometry.depth_max_m)
    odometry.complain("depth_max_m", fmt::format("is {}, expected more than depth_min_m, {}",
                                                 config.odometry.depth_max_m, config.odometry.depth_min_m));
  odometry.read("depth_noise_floor_m", config.odometry.alignment.noise.floor_m, 1e-4, 0.1);
  odometry.read("depth_noise_factor_per_m", config.odometry.alignment.noise.factor_per_m, 0, 0.1);
  odometry.read("photometric_weight", config.odometry.alignment.photometric_weight, 0, 10);
  odometry.read("inherited_frames", config.odometry.inherited_frames, 0, 1000);
  odometry.read("lost_after_frames", config.odometry.lost_after, 1, 1000);
  odometry.read("threads", config.odometry.threads, 1, 64);
  odometry.read("relocalise_frames", config.recovery.patience_frames, 0, 100000);
  config.recovery.relocaliser.noise = config.odometry.alignment.noise;

  ConfigReader keyframes = reader->section("keyframes");
  keyframes.read("translation_m", config.keyframes.translation_m, 0.01, 2);
  keyframes.read("rotation_rad", config.keyframes.rotation_rad, 0.01, 1);
  keyframes.read("overlap", config.keyframes.overlap, 0.3, 0.99);
  keyframes.read("max_frames", config.keyframes.max_frames, 1, 200);
  keyframes.read("depth_step_per_m", config.depth_rounding.step_per_m, 0.0001, 0.005);

  ConfigReader uplink = reader->section("uplink");
  uint32_t window = static_cast<uint32_t>(config.sender.send.window);
  uint32_t waiting = static_cast<uint32_t>(config.max_waiting_keyframes);
  int64_t resend_ms = config.sender.send.resend_after.count();
  int64_t budget = static_cast<int64_t>(config.sender.send.budget_bytes_per_s);
  uplink.read("window_keyframes", window, 1, 64);
  uplink.read("max_waiting_keyframes", waiting, 2, 100000);
  uplink.read("resend_after_ms", resend_ms, 50, 600000);
  uplink.read("budget_bytes_per_s", budget, 0, 1'000'000'000);
  uplink.read("jpeg_quality", config.sender.jpeg_quality, 30, 100);
  config.sender.send.window = window;
  config.sender.send.budget_bytes_per_s = static_cast<uint64_t>(budget);
  config.max_waiting_keyframes = waiting;
  config.sender.send.resend_after = std::chrono::milliseconds(resend_ms);

  ConfigReader outbox = reader->section("outbox");
  outbox.read("kind", config.outbox.kind, {"disk", "memory"});
  outbox.read("directory", config.outbox.directory);
  outbox.read("quota_mb", config.outbox.quota_mb, 0, 10'000'000);
  outbox.read("thin_jpeg_quality", config.sender.thin_jpeg_quality, 5, 100);
  if (config.sender.thin_jpeg_quality > config.sender.jpeg_quality)
    outbox.complain("thin_jpeg_quality", fmt::format("is {}, expected at most uplink.jpeg_quality, {}",
                                                     config.sender.thin_jpeg_quality, config.sender.jpeg_quality));
  if (config.outbox.quota_mb == 0) config.outbox.quota_mb = kUnlimited_mb;

  reader->section("ferns").read("seed", config.fern_seed);

  ConfigReader downlink = reader->section("downlink");
  downlink.read("radius_m", config.interest_radius_m, 0.5, 1000);
  downlink.read("budget_bytes_per_s", config.downlink_bytes_per_s, 1000, 1'000'000'000);

  ConfigReader localizer = reader->section("localizer");
  localizer.read("enabled", config.localizer.enabled);
  localizer.read("every_frames", config.localizer.every_frames, 1, 1000);
  localizer.read("memory_mb", config.localizer.memory_mb, 1, 100'000);
  localizer.read("disk_mb", config.localizer.disk_mb, 0, 1'000'000);
  localizer.read("smooth_frames", config.localizer.smooth_frames, 1, 1000);
  config.localizer.registration.noise = config.odometry.alignment.noise;
  config.localizer.registration.view.depth_max_m = config.odometry.depth_max_m;
  ConfigReader api = reader->section("api");
  api.read("socket", config.api.socket);
  api.read("group", config.api.group);
  readTelemetryOptions(*reader, config.telemetry);
  ros2::readRos2Options(*reader, config.ros2);
  if (auto finished = reader->finish(); !finished) return finished.error();
  return config;
}

std::string printAgentConfig(const AgentConfig& c) {
  return fmt::format(
             R"(# A robot's agent. Every key is optional; these are the values in force.
robot: {}                # 1-32 characters of a-z 0-9 _ -
source: {}             # where frames come from; edge_agent --list-sources
link:
  domain: {}             # DDS domain, 0..230; the same as the core's
  site: {}             # the core's site
  interface_address: {}  # the one network interface to use: its IPv4 address, or its name
  profile: {}          # local: this machine; lan: small datagrams; wan: no multicast; auto: local on 127.*, else lan
  core_address: {}     # wan: IPv4 address of the core
  discovery_server: {} # HOST or HOST:PORT, for networks without multicast; empty: none
  keys: {}             # folder made by fleet keys: messages are encrypted; empty: clear text
  insecure: {}         # true: clear text on an interface other than loopback
odometry:
  depth_min_m: {}
  depth_max_m: {}
  depth_noise_floor_m: {}       # 1 sigma = floor + factor * depth^2
  depth_noise_factor_per_m: {}
  photometric_weight: {}        # of colour against depth
  inherited_frames: {}          # as how many frames a keyframe's mean depth counts in the next one's
  lost_after_frames: {}         # poor ones in a row
  threads: {}                   # that share a frame's rows; poses do not depend on it
  relocalise_frames: {}         # tried to find a known place again before a new chain begins
keyframes:                      # a new one after any of these
  translation_m: {}             # at 2 m median depth, scaled with it
  rotation_rad: {}
  overlap: {}                   # with the last keyframe, below this
  max_frames: {}
  depth_step_per_m: {}          # rounding of mean depth: step = this * depth^2
uplink:
  window_keyframes: {}          # in flight at a time
  max_waiting_keyframes: {}     # a recording pauses at so many unacknowledged; with --realtime it never does
  resend_after_ms: {}           # at first; longer on a slow link
  budget_bytes_per_s: {}     # mean rate of keyframes; 0: as fast as the link takes them
  jpeg_quality: {}
outbox:                         # where keyframes are until the core has them
  kind: {}                    # disk, or memory: what waits is lost with the process
  directory: {}               # empty: $STATE_DIRECTORY, $XDG_STATE_HOME/comap or $HOME/.local/state/comap
  quota_mb: {}                # then coarser colour, then fewer keyframes; in memory 256 at most; 0: no limit
  thin_jpeg_quality: {}
ferns:
  seed: {}                   # of the book of place codes; the same as the core's
downlink:
  radius_m: {}                  # of map tiles wanted around the robot
  budget_bytes_per_s: {}
localizer:                      # what returned tiles are used for
  enabled: {}                 # register against them: bounds drift, finds a lost robot in what others have mapped
  every_frames: {}              # that are tracked well, a registration
  memory_mb: {}                # of tiles; beyond it the farthest are forgotten, and asked for again when near
  disk_mb: {}                   # of tiles kept beside an outbox on disk, for a restart; 0: none
  smooth_frames: {}             # time constant of the pose that consumers see
api:                            # pose and map for other programs on this robot, see docs/robot-api.md
  socket: {}                    # path of a socket that is made; empty: none
  group: {}                  # true: the agent's group may read too, not only its user
{})",
             yamlText(c.robot), yamlText(c.source), c.link.domain, yamlText(c.link.site),
             yamlText(c.link.interface_address), c.link.profile, yamlText(c.link.core_address),
             yamlText(c.link.discovery_server), yamlText(c.link.keys), c.link.insecure, c.odometry.depth_min_m,
             c.odometry.depth_max_m, c.odometry.alignment.noise.floor_m, c.odometry.alignment.noise.factor_per_m,
             c.odometry.alignment.photometric_weight, c.odometry.inherited_frames, c.odometry.lost_after,
             c.odometry.threads, c.recovery.patience_frames, c.keyframes.translation_m, c.keyframes.rotation_rad,
             c.keyframes.overlap, c.keyframes.max_frames, c.depth_rounding.step_per_m, c.sender.send.window,
             c.max_waiting_keyframes, c.sender.send.resend_after.count(), c.sender.send.budget_bytes_per_s,
             c.sender.jpeg_quality, c.outbox.kind, yamlText(c.outbox.directory),
             c.outbox.quota_mb == kUnlimited_mb ? 0 : c.outbox.quota_mb, c.sender.thin_jpeg_quality, c.fern_seed,
             c.interest_radius_m, c.downlink_bytes_per_s, c.localizer.enabled, c.localizer.every_frames,
             c.localizer.memory_mb, c.localizer.disk_mb, c.localizer.smooth_frames, yamlText(c.api.socket), c.api.group,
             printCameraConfig(c.camera)) +
         printTelemetryOptions(c.telemetry) + ros2::printRos2Options(c.ros2);
}

}  // namespace comap
