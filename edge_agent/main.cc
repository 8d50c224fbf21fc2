// The robot's agent: reads its cameras or a recording, tracks, ships keyframes, takes the joint map's tiles.
#include <signal.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <random>
#include <thread>

#include "edge_agent/agent.h"
#include "edge_agent/agent_metrics.h"
#include "edge_agent/agent_report.h"
#include "edge_agent/capture/capture_commands.h"
#include "edge_agent/capture/source_uri.h"
#include "edge_agent/ros2_output.h"
#include "protocol/link/dds_link.h"
#include "protocol/link/loopback_link.h"
#include "protocol/types/whole_file.h"

namespace comap {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;
using std::chrono::seconds;

volatile sig_atomic_t g_stop = 0;

using Tell = std::function<void()>;  // those who watch over this agent

struct Arguments {
  std::string config, source, robot, site, interface_address, keys, report, outbox, log_format, trace, status_address,
      preview, check_calibration, record;
  int domain = -1, threads = 0, status_port = -1;
  bool insecure = false, realtime = false, offline = false, deliver = false, list_sources = false, print_config = false,
       check_config = false, health = false, ros2 = false;
  int patience_s = 60;
  size_t frames = 0;  // to record; 0 = until it is stopped
};

int failWith(const Error& error, const Log& log = Log(LogFormat::kText, "edge_agent")) {
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
  if (!arguments.site.empty()) config.link.site = arguments.site;
  if (!arguments.interface_address.empty()) config.link.interface_address = arguments.interface_address;
  if (arguments.domain >= 0) config.link.domain = arguments.domain;
  if (arguments.threads > 0) config.odometry.threads = arguments.threads;
  if (!arguments.keys.empty()) config.link.keys = arguments.keys;
  config.link.insecure = config.link.insecure || arguments.insecure;
  if (arguments.outbox == "memory") {
    config.outbox.kind = "memory";
  } else if (!arguments.outbox.empty()) {
    config.outbox.kind = "disk";
    config.outbox.directory = arguments.outbox;
  }
  if (arguments.offline && config.outbox.kind == "memory")
    return Error{ErrorCode::kWrongUse, "--offline keeps keyframes for a later start: it needs an outbox on disk"};
  if (const std::string problem = robotNameProblem(config.robot); !problem.empty())
    return Error{ErrorCode::kWrongUse, problem};
  config.link.role = LinkRole::kRobot;
  config.link.robot = config.robot;
  if (arguments.status_port >= 0) config.telemetry.status_port = arguments.status_port;
  if (!arguments.log_format.empty()) config.telemetry.log_format = arguments.log_format;
  if (!arguments.status_address.empty()) config.telemetry.status_address = arguments.status_address;
  config.telemetry.trace = arguments.trace;
  config.ros2.enabled = config.ros2.enabled || arguments.ros2;
  if (config.ros2.enabled)
    if (auto checked = ros2::checkRos2Options(config.ros2, config.link.domain); !checked) return checked.error();
  config.link.notice = [name = config.robot, log = makeLog(config.telemetry, "edge_agent")](const std::string& line) {
    log.info(name + ": " + line);
  };
  config.link.max_blocking_ms = 50;  // frames go on; what the link does not take stays in the outbox
  return config;
}

// Unique per start: seconds since 1970 and 24 random bits, so that two quick restarts differ as well.
uint64_t newSession() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const auto s = static_cast<uint64_t>(std::chrono::duration_cast<seconds>(now).count());
  return s << 24 | (std::random_device{}() & 0xffffffu);
}

Result<void> awaitCore(const AgentConfig& config, const Link& link, int patience_s, const Tell& tell) {
  const auto deadline = Clock::now() + seconds(patience_s);
  while (link.peers() == 0 && g_stop == 0) {
    if (Clock::now() > deadline)
      return Error{ErrorCode::kUnreachable, "no mapping core answers in site '" + config.link.site + "', DDS domain " +
                                                std::to_string(config.link.domain) + " on " +
                                                config.link.interface_address + " after " + std::to_string(patience_s) +
                                                " s: is it running, with the same site and domain?"};
    tell();
    std::this_thread::sleep_for(milliseconds(20));
  }
  return {};
}

std::string whatWaits(const Agent& agent, const std::string& outbox) {
  const std::string count = std::to_string(agent.unacknowledged()) + " keyframes";
  if (outbox.empty()) return count + " are not acknowledged by the core: they are lost";
  std::string text = count + " wait in " + outbox + " and are sent by the next start";
  if (agent.onlyInMemory() > 0)
    text += ", except " + std::to_string(agent.onlyInMemory()) + " that could not be written there: they are lost";
  return text;
}

Error silentCore(const Agent& agent, int patience_s, const std::string& outbox) {
  return {ErrorCode::kUnreachable,
          "the core has been silent for " + std::to_string(patience_s) + " s; " + whatWaits(agent, outbox)};
}

// For a start that only delivers what earlier ones have left.
class NoSource final : public FrameSource {
 public:
  Result<std::optional<Frame>> next() override { return std::optional<Frame>(); }
  size_t size() const override { return 0; }
  std::string description() const override { return "delivers what waits in its outbox"; }
};

// While frames come. Recorded sources play as fast as the core keeps up, or at their own speed; a camera has its own.
Result<void> drive(Agent& agent, const Arguments& arguments, bool live, const std::string& outbox, const Tell& tell) {
  const bool realtime = arguments.realtime && !live, in_time = arguments.realtime || live || arguments.offline;
  const int patience_s = arguments.patience_s;
  const auto start = Clock::now();
  auto last_progress = start;
  uint32_t frames = 0;
  uint32_t unacknowledged = 0;
  while (g_stop == 0) {
    tell();
    const auto taken = agent.takeFrame();
    if (!taken) return taken.error();
    if (*taken == Agent::Progress::kEnded) return {};
    if (auto exchanged = agent.exchange(milliseconds(*taken == Agent::Progress::kWaiting ? 20 : 0)); !exchanged)
      return exchanged;
    if (*taken == Agent::Progress::kFrame || agent.unacknowledged() != unacknowledged) last_progress = Clock::now();
    unacknowledged = agent.unacknowledged();
    if (!in_time && Clock::now() - last_progress > seconds(patience_s)) return silentCore(agent, patience_s, outbox);
    const AgentStatistics& taken_so_far = agent.statistics();
    if (!realtime || taken_so_far.frames == frames) continue;
    frames = taken_so_far.frames;
    const auto due = start + std::chrono::nanoseconds(taken_so_far.last_stamp_ns - taken_so_far.first_stamp_ns);
    while (Clock::now() < due && g_stop == 0) {
      tell();
      const auto left = std::chrono::duration_cast<milliseconds>(due - Clock::now()) + milliseconds(1);
      if (auto exchanged = agent.exchange(std::min(left, milliseconds(1000))); !exchanged) return exchanged;
    }
  }
  return agent.closeKeyframe();
}

// After the last frame: until the core has all keyframes in its map and no more tiles come.
Result<void> settle(Agent& agent, int patience_s, const std::string& outbox, const Tell& tell) {
  constexpr milliseconds kInterestPeriod(500), kQuiet(2500);
  auto last_progress = Clock::now(), last_news = Clock::now(), last_interest = Clock::now() - kInterestPeriod;
  uint32_t unacknowledged = agent.unacknowledged();
  uint32_t mapped = agent.mappedBelow();
  uint64_t tiles = agent.statistics().tiles_received;
  while (g_stop == 0) {
    tell();
    const auto now = Clock::now();
    if (now - last_interest >= kInterestPeriod) {
      agent.sendInterest();
      agent.sendStatus(agent.allAcknowledged());
      last_interest = now;
    }
    if (auto exchanged = agent.exchange(milliseconds(50)); !exchanged) return exchanged;
    if (agent.unacknowledged() != unacknowledged || agent.mappedBelow() != mapped) {
      unacknowledged = agent.unacknowledged();
      mapped = agent.mappedBelow();
      last_progress = last_news = Clock::now();
    }
    if (agent.statistics().tiles_received != tiles) {
      tiles = agent.statistics().tiles_received;
      last_news = Clock::now();
    }
    if (agent.allAcknowledged() && agent.allMapped() && Clock::now() - last_news > kQuiet) return {};
    if (Clock::now() - last_progress > seconds(patience_s)) {
      if (agent.allAcknowledged()) return {};
      return silentCore(agent, patience_s, outbox);
    }
  }
  return {};
}

Result<void> work(Agent& agent, const AgentConfig& config, const Link& link, const Arguments& arguments, bool live,
                  const std::string& outbox, const Tell& tell) {
  if (auto greeted = agent.hello(); !greeted) return greeted;
  if (!arguments.realtime && !live && !arguments.offline)
    if (auto found = awaitCore(config, link, arguments.patience_s, tell); !found) return found;
  if (auto driven = drive(agent, arguments, live, outbox, tell); !driven) return driven;
  if (arguments.offline) return {};
  return settle(agent, arguments.patience_s, outbox, tell);
}

Result<std::unique_ptr<FrameSource>> sourceOf(const AgentConfig& config, const Arguments& arguments,
                                              const CaptureLog& log) {
  if (arguments.deliver) return std::unique_ptr<FrameSource>(std::make_unique<NoSource>());
  if (config.source.empty())
    return Error{ErrorCode::kWrongUse, "no source: give --source or 'source' in the configuration"};
  return openSource(config.source, config.camera, log);
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

int run(const Arguments& arguments) {
  auto config = configure(arguments);
  if (!config) return failWith(config.error());
  const Log lines = makeLog(config->telemetry, "edge_agent");
  const auto failWith = [&](const Error& error) { return comap::failWith(error, lines); };
  if (arguments.print_config) {
    std::printf("%s", printAgentConfig(*config).c_str());
    return 0;
  }
  if (arguments.check_config) return 0;
  if (arguments.health) return askHealth(config->telemetry, lines);
  if (auto writable = checkFolderOf(arguments.report); !writable) return failWith(writable.error());
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
  auto outbox = openOutbox(config->outbox, config->robot, log);
  if (!outbox) return failWith(outbox.error());
  const std::string outbox_path = config->outbox.kind == "memory" ? "" : outbox->path();
  const auto session = outbox->beginSession(newSession());
  if (!session) return failWith(session.error());
  if (outbox->size() > 0)
    log(config->robot + ": " + std::to_string(outbox->size()) + " keyframes of earlier starts wait in " + outbox_path);
  log(config->robot + ": " + (*source)->description());
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
  Agent agent(*config, *session, std::move(*outbox), **source, **link, log, record);
  const Tell tell = [&] {
    telemetry->tell(kAgentMetrics, [&] { return reportOf(agent, config->robot); });
    if (ros2) ros2->follow(agent);
  };
  const auto done = work(agent, *config, **link, arguments, live, outbox_path, tell);
  if (const auto health = (*source)->health()) log("camera: " + toString(*health));
  // What was done is told even if it ended badly.
  if (report)
    if (auto written = report->finish(reportOf(config->robot, agent)); !written) return failWith(written.error());
  if (auto traced = telemetry->finish(); !traced) return failWith(traced.error());
  if (!done) return failWith(done.error());
  if (agent.allAcknowledged()) return 0;
  if (outbox_path.empty() || agent.onlyInMemory() > 0)
    return failWith({ErrorCode::kProblem, "stopped: " + whatWaits(agent, outbox_path)});
  log(config->robot + ": " + whatWaits(agent, outbox_path));
  return 0;
}

}  // namespace
}  // namespace comap

int main(int argc, char** argv) {
  comap::Arguments arguments;
  CLI::App app("A robot's agent: tracks its RGB-D stream, ships keyframes to the mapping core, takes map tiles back.",
               "edge_agent");
  app.footer(
      "Example: edge_agent --robot a --source tum:data/flat/a\n"
      "         edge_agent --config robot.yaml --realtime\n"
      "Exit codes: 0 ok, 1 refused by the core, 2 wrong use, 3 cannot reach or read.");
  app.add_option("--config", arguments.config, "YAML file; --print-config shows all keys");
  app.add_option("--source", arguments.source, "Where frames come from, see --list-sources");
  app.add_option("--robot", arguments.robot, "This robot's name: 1-32 of a-z 0-9 _ -");
  app.add_option("--core-site", arguments.site, "Site of the mapping core");
  app.add_option("--domain", arguments.domain, "DDS domain")->check(CLI::Range(0, 230));
  app.add_option("--interface", arguments.interface_address, "Network interface to use: its IPv4 address, or its name");
  app.add_option("--keys", arguments.keys, "Folder of this program's keys, made by fleet keys: messages are encrypted");
  app.add_flag("--insecure", arguments.insecure, "Allow clear text on an interface other than loopback");
  app.add_option("--report", arguments.report, "Write what was done to this JSON file at the end");
  app.add_option("--patience", arguments.patience_s, "Seconds without the core before giving up")
      ->check(CLI::Range(1, 86400))
      ->capture_default_str();
  app.add_option("--threads", arguments.threads, "Threads that share a frame's odometry; 1 unless configured")
      ->check(CLI::Range(1, 64));
  app.add_option("--outbox", arguments.outbox,
                 "Folder for keyframes until the core has them, or the word memory: lost with the process");
  app.add_option("--status-port", arguments.status_port, "Port of /metrics, /healthz and /readyz; 0: none")
      ->check(CLI::Range(0, 65535));
  app.add_option("--status-address", arguments.status_address, "Address where it listens; 127.0.0.1 unless told");
  app.add_flag("--health", arguments.health, "Ask the status page of the one that runs whether it is well, and stop");
  app.add_option("--log-format", arguments.log_format, "Lines on stderr as text or json")
      ->check(CLI::IsMember({"text", "json"}));
  app.add_option("--trace", arguments.trace, "Write when each stage of the work ran to this file, for ui.perfetto.dev");
  app.add_flag("--ros2", arguments.ros2,
               "Publish odometry, path and frames for ROS 2 programs; see ros2 in --print-config");
  app.add_flag("--deliver", arguments.deliver, "Take no frames: send what waits in the outbox and stop");
  app.add_flag("--offline", arguments.offline, "Without a core: keep all keyframes in the outbox and stop")
      ->excludes("--deliver");
  app.add_flag("--realtime", arguments.realtime, "Play a recording at its own speed");
  app.add_flag("--list-sources", arguments.list_sources, "Print the kinds of sources and the cameras found, and stop");
  app.add_option("--preview", arguments.preview,
                 "Write one frame, colour and depth side by side, to this PNG and stop");
  app.add_option("--record", arguments.record,
                 "Write frames to this folder, as --source takes them back, and do no more")
      ->excludes("--preview");
  app.add_option("--calibrate-check", arguments.check_calibration,
                 "Tell whether edges of colour and depth agree, draw them to this PNG and stop")
      ->excludes("--preview")
      ->excludes("--record");
  app.add_option("--frames", arguments.frames, "With --record: stop after so many")->needs("--record");
  app.add_flag("--print-config", arguments.print_config, "Print the configuration in force and stop");
  app.add_flag("--check-config", arguments.check_config, "Check the configuration and stop");
  app.set_version_flag("--version", "edge_agent " COMAP_VERSION);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  if (arguments.list_sources) {
    comap::listSources();
    return 0;
  }
  struct sigaction action {};
  action.sa_handler = [](int) { comap::g_stop = 1; };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  return comap::run(arguments);
}
