#include <algorithm>
#include <chrono>
#include <fstream>
#include <memory>

#include "edge_agent/agent.h"
#include "edge_agent/capture/source_uri.h"
#include "fleet_tools/replay/replay.h"
#include "fleet_tools/replay/run_folder.h"
#include "mapping_core/service/core_config.h"
#include "protocol/link/loopback_link.h"

namespace comap {
namespace {

constexpr std::chrono::milliseconds kNoWait{0};
constexpr int kDeliveryRounds = 200;  // of tiles at the end; each brings up to half a second's budget

struct ReplayedRobot {
  std::string name;
  std::unique_ptr<FrameSource> source;
  std::unique_ptr<Link> link;
  std::unique_ptr<Agent> agent;
  std::vector<FrameRecord> trajectory;
  bool ended = false;
};

Result<void> drain(MappingService& service) {
  for (;;) {
    const auto worked = service.step(kNoWait);
    if (!worked) return worked.error();
    if (!*worked) return {};
  }
}

// One frame of every robot, then the core, then what came back.
Result<bool> playRound(std::vector<ReplayedRobot>& robots, MappingService& service) {
  bool any = false;
  for (ReplayedRobot& robot : robots) {
    if (robot.ended) continue;
    const auto taken = robot.agent->takeFrame();
    if (!taken) return Error{taken.error().code, "robot " + robot.name + ": " + taken.error().text};
    robot.ended = *taken == Agent::Progress::kEnded;
    any = any || !robot.ended;
    if (auto sent = robot.agent->exchange(kNoWait); !sent) return sent.error();
  }
  if (auto drained = drain(service); !drained) return drained.error();
  for (ReplayedRobot& robot : robots)
    if (auto heard = robot.agent->exchange(kNoWait); !heard) return heard.error();
  return any;
}

Result<void> deliverTiles(std::vector<ReplayedRobot>& robots, MappingService& service) {
  if (auto refreshed = service.refreshTiles(); !refreshed) return refreshed;
  for (int round = 0; round < kDeliveryRounds; ++round) {
    uint64_t before = 0, after = 0;
    for (ReplayedRobot& robot : robots) {
      before += robot.agent->statistics().tiles_received;
      robot.agent->sendInterest();
    }
    if (auto drained = drain(service); !drained) return drained;
    for (ReplayedRobot& robot : robots) {
      if (auto heard = robot.agent->exchange(kNoWait); !heard) return heard;
      after += robot.agent->statistics().tiles_received;
    }
    if (after == before) return {};
  }
  return {};
}

}  // namespace

Result<ReplayOutcome> replayLoopback(const ReplayOptions& options, const ReplayProgress& progress) {
  const auto start = std::chrono::steady_clock::now();
  std::ofstream events(options.out + "/events.log");
  const auto logAs = [&](const std::string& who) {
    return [&events, who](const std::string& line) { events << who << ": " << line << '\n'; };
  };

  // Sources first: a wrong folder is told before a device is started or a file is made.
  LoopbackHub hub;
  std::vector<ReplayedRobot> robots;
  size_t frames = 0;
  for (const ReplayRobot& robot : options.robots) {
    auto source = openSource(robot.source);
    if (!source) return Error{source.error().code, "robot " + robot.name + ": " + source.error().text};
    frames = std::max(frames, (*source)->size());
    robots.push_back({robot.name, std::move(*source), hub.connect(LinkRole::kRobot, robot.name), nullptr, {}, false});
  }
  CoreConfig core;
  core.service.mapping.fern_seed = options.fern_seed;
  core.service.pace_tiles = false;
  core.service.hurry_from_waiting = 0;
  core.service.half_detail_from_load = 0;
  gpu::DeviceOptions device_options;
  device_options.choice = options.device;
  device_options.cache_directory = gpu::defaultCacheDirectory();
  auto device = gpu::Device::create(device_options);
  if (!device) return device.error();
  auto store = MapStore::open(storePathOf(options.out), MapStore::Mode::kCreateOrOpen);
  if (!store) return store.error();
  const auto link = hub.connect(LinkRole::kCore);
  MappingService service(core.service, *link, *store, *device,
                         [say = logAs("core")](LogLevel, const std::string& line) { say(line); });

  uint64_t session = 0;
  for (ReplayedRobot& robot : robots) {
    AgentConfig config;
    config.robot = robot.name;
    config.fern_seed = options.fern_seed;
    config.outbox.kind = "memory";
    config.sender.send.budget_bytes_per_s = 0;  // no waiting for a clock: the same order each time
    config.sender.send.paced = false;
    auto outbox = Outbox::inMemory();
    if (!outbox) return outbox.error();
    robot.agent =
        std::make_unique<Agent>(config, ++session, std::move(*outbox), *robot.source, *robot.link, logAs(robot.name),
                                [&robot](const FrameRecord& frame) { robot.trajectory.push_back(frame); });
    if (auto greeted = robot.agent->hello(); !greeted) return greeted.error();
  }
  if (auto drained = drain(service); !drained) return drained.error();

  for (size_t round = 1;; ++round) {
    const auto any = playRound(robots, service);
    if (!any) return any.error();
    if (!*any) break;
    progress("frames", std::min(round, frames), frames);
  }
  if (auto delivered = deliverTiles(robots, service); !delivered) return delivered.error();
  if (auto finished = service.finish([&](size_t done, size_t all) { progress("rebuild", done, all); }); !finished)
    return finished.error();

  ReplayOutcome outcome;
  for (ReplayedRobot& robot : robots) {
    outcome.robots.push_back(reportOf(robot.name, *robot.agent));
    outcome.robots.back().trajectory = std::move(robot.trajectory);
  }
  outcome.core = reportOf(service, device->info().name);
  outcome.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return outcome;
}

}  // namespace comap
