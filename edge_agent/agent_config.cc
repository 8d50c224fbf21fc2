#include "edge_agent/agent_config.h"

#include <spdlog/fmt/fmt.h>

#include "protocol/config/config_reader.h"

namespace comap {

Result<AgentConfig> readAgentConfig(const std::string& path) {
  auto reader = ConfigReader::fromFile(path);
  if (!reader) return reader.error();
  AgentConfig config;
  reader->read("robot", config.robot);
  if (const std::string problem = robotNameProblem(config.robot); !problem.empty()) reader->complain("robot", problem);
  reader->read("source", config.source);

  ConfigReader link = reader->section("link");
  link.read("domain", config.link.domain, 0, 230);
  link.read("site", config.link.site);
  link.read("interface_address", config.link.interface_address);
  link.read("insecure", config.link.insecure);

  ConfigReader odometry = reader->section("odometry");
  odometry.read("depth_min_m", config.odometry.depth_min_m, 0.05, 2);
  odometry.read("depth_max_m", config.odometry.depth_max_m, 0.5, 13);
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
  uint32_t window = static_cast<uint32_t>(config.sender.window);
  uint32_t waiting = static_cast<uint32_t>(config.max_waiting_keyframes);
  int64_t resend_ms = config.sender.resend_after.count();
  uplink.read("window_keyframes", window, 1, 64);
  uplink.read("max_waiting_keyframes", waiting, 2, 100000);
  uplink.read("resend_after_ms", resend_ms, 50, 600000);
  uplink.read("jpeg_quality", config.sender.jpeg_quality, 30, 100);
  config.sender.window = window;
  config.max_waiting_keyframes = waiting;
  config.sender.resend_after = std::chrono::milliseconds(resend_ms);

  reader->section("ferns").read("seed", config.fern_seed);

  ConfigReader downlink = reader->section("downlink");
  downlink.read("radius_m", config.interest_radius_m, 0.5, 1000);
  downlink.read("budget_bytes_per_s", config.downlink_bytes_per_s, 1000, 1'000'000'000);
  if (auto finished = reader->finish(); !finished) return finished.error();
  return config;
}

std::string printAgentConfig(const AgentConfig& c) {
  return fmt::format(
      R"(# A robot's agent. Every key is optional; these are the values in force.
robot: {}                # 1-32 characters of a-z 0-9 _ -
source: "{}"             # where frames come from; edge_agent --list-sources
link:
  domain: {}             # DDS domain, 0..230; the same as the core's
  site: "{}"             # the core's site
  interface_address: "{}"  # the one network interface to use
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
  max_waiting_keyframes: {}     # a recorded source pauses at so many unacknowledged
  resend_after_ms: {}
  jpeg_quality: {}
ferns:
  seed: {}                   # of the book of place codes; the same as the core's
downlink:
  radius_m: {}                  # of map tiles wanted around the robot
  budget_bytes_per_s: {}
)",
      c.robot, c.source, c.link.domain, c.link.site, c.link.interface_address, c.link.insecure, c.odometry.depth_min_m,
      c.odometry.depth_max_m, c.odometry.alignment.noise.floor_m, c.odometry.alignment.noise.factor_per_m,
      c.odometry.alignment.photometric_weight, c.odometry.inherited_frames, c.odometry.lost_after, c.odometry.threads,
      c.recovery.patience_frames, c.keyframes.translation_m, c.keyframes.rotation_rad, c.keyframes.overlap,
      c.keyframes.max_frames, c.depth_rounding.step_per_m, c.sender.window, c.max_waiting_keyframes,
      c.sender.resend_after.count(), c.sender.jpeg_quality, c.fern_seed, c.interest_radius_m, c.downlink_bytes_per_s);
}

}  // namespace comap
