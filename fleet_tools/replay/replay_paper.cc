#include <chrono>
#include <fstream>

#include "edge_agent/capture/source_uri.h"
#include "fleet_tools/replay/paper_outputs.h"
#include "protocol/codec/keyframe_codec.h"
#include "protocol/link/loopback_link.h"

namespace comap {
namespace {

struct StreamingRobot {
  PaperRobot report;
  std::unique_ptr<FrameSource> source;
  std::unique_ptr<Link> link;
  int64_t first_ns = 0;
};

// A frame on its way to the core, encoded as keyframes are; false once the source has ended.
Result<bool> sendFrame(StreamingRobot& robot) {
  constexpr int kMostDamaged = 10;
  for (int damaged = 0;; ++damaged) {
    auto frame = robot.source->next();
    if (!frame) {
      if (damaged + 1 == kMostDamaged) return frame.error();
      ++robot.report.damaged_frames;
      continue;
    }
    if (!*frame) return false;
    Keyframe message;
    message.id = {robot.report.name, 1, robot.report.frames};
    message.stamp_ns = (*frame)->stamp_ns;
    message.camera = (*frame)->camera;
    message.colour = std::move((*frame)->colour);
    message.depth = std::move((*frame)->depth);
    const auto encoded = encodeKeyframe(message);
    if (!encoded) return encoded.error();
    if (auto sent = robot.link->publish(Topic::kKeyframe, robot.report.name, *encoded); !sent) return sent.error();
    if (robot.report.frames++ == 0) robot.first_ns = message.stamp_ns;
    robot.report.uplink_bytes += encoded->size();
    robot.report.duration_s = 1e-9 * static_cast<double>(message.stamp_ns - robot.first_ns);
    return true;
  }
}

// All frames that have arrived, by camera.
Result<std::vector<std::optional<Frame>>> receiveRound(Link& link, const PaperCore& core) {
  std::vector<std::optional<Frame>> round(core.cameras().size());
  while (auto delivery = link.receive(std::chrono::milliseconds(0))) {
    if (delivery->topic != Topic::kKeyframe) continue;
    auto message = decodeKeyframe(delivery->payload);
    if (!message) return message.error();
    for (const PaperCamera& camera : core.cameras())
      if (camera.name == message->id.robot)
        round[camera.index] =
            Frame{message->stamp_ns, message->camera, std::move(message->colour), std::move(message->depth)};
  }
  return round;
}

}  // namespace

Result<nlohmann::json> replayPaper(const ReplayOptions& options, const PaperOptions& paper_options,
                                   const ReplayProgress& progress) {
  const auto start = std::chrono::steady_clock::now();
  PaperOptions paper = paper_options;
  paper.ferns.seed = options.fern_seed;
  LoopbackHub hub;
  std::vector<StreamingRobot> robots;
  size_t rounds = 0;
  for (const ReplayRobot& robot : options.robots) {
    auto source = openSource(robot.source);
    if (!source) return Error{source.error().code, "robot " + robot.name + ": " + source.error().text};
    rounds = std::max(rounds, (*source)->size());
    StreamingRobot& streaming = robots.emplace_back();
    streaming.report.name = robot.name;
    streaming.source = std::move(*source);
    streaming.link = hub.connect(LinkRole::kRobot, robot.name);
  }
  gpu::DeviceOptions device_options;
  device_options.choice = options.device;
  device_options.cache_directory = gpu::defaultCacheDirectory();
  auto device = gpu::Device::create(device_options);
  if (!device) return device.error();
  std::ofstream events(options.out + "/events.log");
  auto core = PaperCore::create(*device, paper, [&events](const std::string& line) { events << line << '\n'; });
  if (!core) return core.error();
  const auto link = hub.connect(LinkRole::kCore);
  for (const StreamingRobot& robot : robots)
    if (auto added = (*core)->addCamera(robot.report.name); !added) return added.error();

  for (size_t round = 1;; ++round) {
    bool any = false;
    for (StreamingRobot& robot : robots) {
      const auto sent = sendFrame(robot);
      if (!sent) return Error{sent.error().code, "robot " + robot.report.name + ": " + sent.error().text};
      any = any || *sent;
    }
    if (!any) break;
    const auto frames = receiveRound(*link, **core);
    if (!frames) return frames.error();
    if (auto played = (*core)->playRound(*frames); !played) return played.error();
    progress("frames", std::min(round, rounds), rounds);
  }
  PaperOutcome outcome;
  for (StreamingRobot& robot : robots) outcome.robots.push_back(robot.report);
  outcome.device = device->info().name;
  outcome.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return writePaperOutputs(options, **core, outcome);
}

}  // namespace comap
