// The robot's agent: reads its cameras or a recording, tracks, ships keyframes, takes the joint map's tiles.
#include <signal.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <memory>
#include <new>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>

#include "edge_agent/agent.h"
#include "edge_agent/agent_metrics.h"
#include "edge_agent/agent_report.h"
#include "edge_agent/agent_run.h"
#include "edge_agent/api_output.h"
#include "edge_agent/capture/capture_commands.h"
#include "edge_agent/capture/preloaded_source.h"
#include "edge_agent/capture/source_uri.h"
#include "edge_agent/realtime_lag.h"
#include "edge_agent/ros2_output.h"
#include "protocol/link/dds_link.h"
#include "protocol/link/loopback_link.h"
#include "protocol/program/out_of_memory.h"
#include "protocol/program/service_arguments.h"
#include "protocol/program/standard_output.h"
#include "protocol/telemetry/stage_clock.h"
#include "protocol/types/counted.h"
#include "protocol/types/whole_file.h"

namespace comap {
namespace {

volatile sig_atomic_t g_stop = 0;

struct Arguments : ServiceArguments {
  std::string source, robot, outbox, api_socket, preview, check_calibration, record;
  int threads = 0, patience_s = 60;
  bool realtime = false, preload = false, offline = false, deliver = false, list_sources = false;
  size_t frames = 0;  // to record; 0 = until it is stopped
};

int failWith(const Error& error, const Log& log) {
  log.error(error.text);
  return exitCodeOf(error.code);
}

Result<AgentConfig> configure(const Arguments& arguments) {
  AgentConfig config;
  if (!arguments.config.empty()) {
    auto read = readAgentConfig(arguments.config);
    if (!read) return read.error();
    config = std::move(*read);
  }
  if (!arguments.source.empty()) config.source = arguments.source;
  if (!arguments.robot.empty()) config.robot = arguments.robot;
  if (arguments.threads > 0) config.odometry.threads = arguments.threads;
  if (arguments.outbox == "memory") {
    config.outbox.kind = "memory";
  } else if (!arguments.outbox.empty()) {
    config.outbox.kind = "disk";
    config.outbox.directory = arguments.outbox;
  }
  if (!arguments.api_socket.empty()) config.api.socket = arguments.api_socket;
  if (arguments.offline && config.outbox.kind == "memory")
    return Error{ErrorCode::kWrongUse, "--offline keeps keyframes for a later start: it needs an outbox on disk"};
  if (const std::string problem = robotNameProblem(config.robot); !problem.empty())
    return Error{ErrorCode::kWrongUse, problem};
  config.link.role = LinkRole::kRobot;
  config.link.robot = config.robot;
  config.link.max_blocking_ms = 50;  // frames go on; what the link does not take stays in the outbox
  if (auto applied = apply(arguments, "edge_agent", config.robot + ": ", config.link, config.telemetry, config.ros2);
      !applied)
    return applied.error();
  return config;
}

// Unique per start: seconds since 1970 and 24 random bits, so that two quick restarts differ as well.
uint64_t newSession() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const auto s = static_cast<uint64_t>(std::chrono::duration_cast<std::chrono::seconds>(now).count());
  return s << 24 | (std::random_device{}() & 0xffffffu);
}

// For a start that only delivers what earlier ones have left.
class NoSource final : public FrameSource {
 public:
  Result<std::optional<Frame>> next() override { return std::optional<Frame>(); }
  size_t size() const override { return 0; }
  std::string description() const override { return "delivers what waits in its outbox"; }
};

Result<std::unique_ptr<FrameSource>> sourceOf(const AgentConfig& config, const Arguments& arguments,
                                              const CaptureLog& log) {
  if (arguments.deliver) return std::unique_ptr<FrameSource>(std::make_unique<NoSource>());
  if (config.source.empty())
    return Error{ErrorCode::kWrongUse, "no source: give --source or 'source' in the configuration"};
  auto source = openSource(config.source, config.camera, log);
  if (!source || !arguments.preload) return source;
  log(config.robot + ": reads " + counted((*source)->size(), "frame") + " before it starts");
  return preload(std::move(*source), [] { return g_stop != 0; });
}

// What is done with a source besides tracking it; nothing if it is to be tracked.
std::optional<Result<void>> onlyCapture(FrameSource& source, const Arguments& arguments, const CaptureLog& log) {
  if (!arguments.preview.empty()) return preview(source, arguments.preview, log);
  if (!arguments.check_calibration.empty()) return checkCalibration(source, arguments.check_calibration, log);
  if (!arguments.record.empty())
    return record(
        source, arguments.record, arguments.frames, [] { return g_stop != 0; }, log);
  return std::nullopt;
}

// Offline there is no wire, not even one that nobody answers on.
Result<std::unique_ptr<Link>> linkOf(const AgentConfig& config, const Arguments& arguments) {
  if (arguments.offline) return LoopbackHub().connect(LinkRole::kRobot, config.robot);
  return connectDds(config.link);
}

// Beside the outbox; a disk that does not take tiles is no reason not to start.
StoredTiles storedTilesOf(const AgentConfig& config, const std::string& outbox_path, const CaptureLog& log) {
  if (outbox_path.empty() || config.localizer.disk_mb == 0) return {};
  const auto path = std::filesystem::path(outbox_path).replace_extension(".tiles").string();
  const uint64_t quota_bytes = uint64_t{1'000'000} * static_cast<uint64_t>(config.localizer.disk_mb);
  auto store = openTileStore(path, quota_bytes, log);
  if (store) return {std::move(*store), quota_bytes, log};
  log("tiles are not kept on disk: " + store.error().text);
  return {};
}

// A recording that shows nothing is not what was meant, though all of it was read.
Error nothingUsed(const AgentConfig& config, const AgentStatistics& statistics) {
  const size_t all = size_t{statistics.frames} + statistics.damaged_frames;
  return {ErrorCode::kBadData, config.robot + ": " + config.source + ": of " + counted(all, "frame") +
                                   " none can be used, " + std::to_string(statistics.damaged_frames) +
                                   (statistics.damaged_frames == 1 ? " is" : " are") +
                                   " damaged and the others have too little depth to start from"};
}

int run(const Arguments& arguments, const Log& early) {
  auto config = configure(arguments);
  if (!config) return failWith(config.error(), early);
  const Log lines = makeLog(config->telemetry, "edge_agent");
  const auto failWith = [&](const Error& error) { return comap::failWith(error, lines); };
  if (arguments.print_config) {
    std::printf("%s", printAgentConfig(*config).c_str());
    return 0;
  }
  if (arguments.check_config) {
    const auto keys = checkKeysOf(config->link);
    return keys ? 0 : failWith(keys.error());
  }
  if (arguments.health) return askHealth(config->telemetry, lines);
  if (auto writable = checkWritable(arguments.report, FileKind::kJson); !writable) return failWith(writable.error());
  auto telemetry = Telemetry::start(config->telemetry);
  if (!telemetry) return failWith(telemetry.error());
  const auto log = [&](const std::string& line) { lines.info(line); };
  auto source = sourceOf(*config, arguments, log);
  if (!source) return failWith(source.error());
  if (const auto captured = onlyCapture(**source, arguments, log)) return *captured ? 0 : failWith(captured->error());
  auto link = linkOf(*config, arguments);
  if (!link) return failWith(link.error());
  std::optional<Ros2Output> ros2;
  if (config->ros2.enabled) {
    auto started = Ros2Output::start(config->ros2, config->link.domain, config->robot);
    if (!started) return failWith(started.error());
    ros2.emplace(std::move(*started));
  }
  auto begun = openOutbox(config->outbox, config->robot, newSession(), log);
  if (!begun) return failWith(begun.error());
  const std::string outbox_path = config->outbox.kind == "memory" ? "" : begun->outbox.path();
  if (const size_t waiting = begun->outbox.size(); waiting > 0)
    log(config->robot + ": " + counted(waiting, "keyframe") + " of earlier starts " +
        wordFor(waiting, "waits", "wait") + " in " + outbox_path);
  log(config->robot + ": " + (*source)->description());
  std::optional<ApiOutput> api;
  if (!config->api.socket.empty()) {
    auto started = ApiOutput::start(config->api, config->robot, begun->session);
    if (!started) return failWith(started.error());
    api.emplace(std::move(*started));
    log(config->robot + ": other programs read pose and map at " + config->api.socket);
  }
  std::optional<AgentReportFile> report;
  if (!arguments.report.empty()) {
    auto created = AgentReportFile::create(arguments.report);
    if (!created) return failWith(created.error());
    report.emplace(std::move(*created));
  }
  const auto record = [&](const FrameRecord& frame) {
    if (report) report->add(frame);
  };
  // What moves on in time does not wait for a core: the outbox takes it all.
  const bool live = (*source)->live();
  if (arguments.realtime || live || arguments.offline)
    config->max_waiting_keyframes = std::numeric_limits<size_t>::max();
  Agent agent(*config, begun->session, std::move(begun->outbox), **source, **link, log, record);
  agent.countDamaged(begun->lost);
  agent.keepTiles(storedTilesOf(*config, outbox_path, log));
  RunOptions options{arguments.realtime, live, arguments.offline, arguments.patience_s, outbox_path};
  options.stopped = [] { return g_stop != 0; };
  RealtimeLag lag;
  options.late = [&](std::chrono::nanoseconds behind, uint32_t frames) {
    if (const auto text = lag.note(behind, frames)) log(config->robot + ": " + *text);
  };
  options.tell = [&] {
    telemetry->tell(kAgentMetrics, [&] { return reportOf(agent, config->robot); });
    if (ros2) ros2->follow(agent);
    if (api) api->follow(agent, log);
  };
  const auto done = runAgent(agent, **link, *config, options);
  if (const auto health = (*source)->health()) log("camera: " + toString(*health));
  if (StageClock::process().traces())
    StageClock::process().note("end", nlohmann::json{{"robot", config->robot},
                                                     {"map", agent.tiles().map()},
                                                     {"hash", agent.tiles().hash()},
                                                     {"tiles", agent.tiles().tiles().size()}}
                                          .dump());
  // What was done is told even if it ended badly.
  if (report) {
    AgentReport told = reportOf(config->robot, agent);
    told.most_behind_s = lag.most_s();
    if (auto written = report->finish(told); !written) return failWith(written.error());
  }
  if (auto traced = telemetry->finish(); !traced) return failWith(traced.error());
  if (!done) return failWith(done.error());
  const bool stopped = g_stop != 0;
  if (!arguments.deliver && !live && !stopped && agent.statistics().keyframes == 0)
    return failWith(nothingUsed(*config, agent.statistics()));
  if (!agent.allAcknowledged()) {
    if (outbox_path.empty() || agent.onlyInMemory() > 0)
      return failWith({ErrorCode::kProblem, "stopped: " + whatWaits(agent, outbox_path)});
    log(config->robot + ": " + whatWaits(agent, outbox_path));
  } else if (const std::string stays = whatStays(agent, outbox_path); !stays.empty()) {
    log(config->robot + ": " + stays);
  }
  // All else went well; but somebody has to know.
  const std::string lost = whatIsLost(agent, begun->more_lost);
  return lost.empty() ? 0 : failWith({ErrorCode::kProblem, lost});
}

}  // namespace
}  // namespace comap

int main(int argc, char** argv) {
  comap::failOnLostOutput("edge_agent");
  comap::Arguments arguments;
  CLI::App app("A robot's agent: tracks its RGB-D stream, ships keyframes to the mapping core, takes map tiles back.",
               "edge_agent");
  app.footer(
      "Example: edge_agent --robot a --source tum:data/flat/a\n"
      "         edge_agent --config robot.yaml --realtime\n"
      "Exit codes: 0 ok, 1 refused by the core or lost with a damaged outbox, 2 wrong use, 3 cannot reach or read.");
  comap::addServiceOptions(app, arguments, "Site of the mapping core",
                           "Publish odometry, path and frames for ROS 2 programs");
  app.add_option("--source", arguments.source, "Where frames come from, see --list-sources");
  app.add_option("--robot", arguments.robot, "This robot's name: 1-32 of a-z 0-9 _ -");
  app.add_option("--patience", arguments.patience_s, "Seconds without the core before giving up")
      ->check(CLI::Range(1, 86400))
      ->capture_default_str();
  app.add_option("--threads", arguments.threads, "Threads that share a frame's odometry; 1 unless configured")
      ->check(CLI::Range(1, 64));
  app.add_option("--outbox", arguments.outbox,
                 "Folder for keyframes until the core has them, or the word memory: lost with the process");
  app.add_option("--api-socket", arguments.api_socket,
                 "Let other programs on this robot read pose and map at this path: see docs/robot-api.md");
  app.add_flag("--deliver", arguments.deliver, "Take no frames: send what waits in the outbox and stop");
  app.add_flag("--offline", arguments.offline, "Without a core: keep all keyframes in the outbox and stop")
      ->excludes("--deliver");
  app.add_flag("--realtime", arguments.realtime, "Play a recording at its own speed");
  app.add_flag("--preload", arguments.preload,
               "Read all of a recording into memory first, so that reading it takes no time from what is measured");
  app.add_flag("--list-sources", arguments.list_sources, "Print the kinds of sources and the cameras found, and stop");
  app.add_option("--preview", arguments.preview,
                 "Write one frame, colour and depth side by side, to this PNG and stop");
  app.add_option("--record", arguments.record,
                 "Write frames to this folder, as --source takes them back, and do no more")
      ->excludes("--preview")
      ->excludes("--deliver");
  app.add_option("--calibrate-check", arguments.check_calibration,
                 "Tell whether edges of colour and depth agree, draw them to this PNG and stop")
      ->excludes("--preview")
      ->excludes("--record");
  app.add_option("--frames", arguments.frames, "With --record: stop after so many")
      ->check(CLI::Range(1, 1'000'000'000))
      ->needs("--record");
  app.set_version_flag("--version", "edge_agent " COMAP_VERSION);
  const comap::Log log = comap::earlyLog(argc, argv, "edge_agent");
  if (const auto ended = comap::parse(app, argc, argv, log)) return *ended;
  if (arguments.list_sources) {
    comap::listSources();
    return 0;
  }
  struct sigaction action {};
  action.sa_handler = [](int) { comap::g_stop = 1; };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  comap::tellWhenOutOfMemory(
      "edge_agent",
      "smaller frames (camera.shrink), and no --preload, need less; what is in an outbox on disk "
      "is kept");
  try {
    return comap::run(arguments, log);
  } catch (const std::bad_alloc&) {
    return comap::exitCodeOf(comap::ErrorCode::kOutOfMemory);  // it was told
  }
}
