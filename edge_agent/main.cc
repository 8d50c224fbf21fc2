// The robot's agent: reads its cameras or a recording, tracks, ships keyframes, takes the joint map's tiles.
#include <signal.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <optional>
#include <random>
#include <thread>

#include "edge_agent/agent.h"
#include "edge_agent/agent_report.h"
#include "edge_agent/capture/source_uri.h"
#include "protocol/link/dds_link.h"
#include "protocol/types/whole_file.h"

namespace comap {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;
using std::chrono::seconds;

volatile sig_atomic_t g_stop = 0;

struct Arguments {
  std::string config, source, robot, site, interface_address, report;
  int domain = -1, threads = 0;
  bool insecure = false, realtime = false, list_sources = false, print_config = false, check_config = false;
  int patience_s = 60;
};

int failWith(const Error& error) {
  std::fprintf(stderr, "edge_agent: %s\n", error.text.c_str());
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
  config.link.insecure = config.link.insecure || arguments.insecure;
  if (const std::string problem = robotNameProblem(config.robot); !problem.empty())
    return Error{ErrorCode::kWrongUse, problem};
  config.link.role = LinkRole::kRobot;
  config.link.robot = config.robot;
  return config;
}

// Unique per start: seconds since 1970 and 24 random bits, so that two quick restarts differ as well.
uint64_t newSession() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const auto s = static_cast<uint64_t>(std::chrono::duration_cast<seconds>(now).count());
  return s << 24 | (std::random_device{}() & 0xffffffu);
}

Result<void> awaitCore(const AgentConfig& config, const Link& link, int patience_s) {
  const auto deadline = Clock::now() + seconds(patience_s);
  while (link.peers() == 0 && g_stop == 0) {
    if (Clock::now() > deadline)
      return Error{ErrorCode::kUnreachable, "no mapping core answers in site '" + config.link.site + "', DDS domain " +
                                                std::to_string(config.link.domain) + " on " +
                                                config.link.interface_address + " after " + std::to_string(patience_s) +
                                                " s: is it running, with the same site and domain?"};
    std::this_thread::sleep_for(milliseconds(20));
  }
  return {};
}

Error silentCore(const Agent& agent, int patience_s) {
  return {ErrorCode::kUnreachable, std::to_string(agent.unacknowledged()) +
                                       " keyframes are not acknowledged and the core has been silent for " +
                                       std::to_string(patience_s) + " s"};
}

// While frames come. Recorded sources play as fast as the core keeps up, or at their own speed.
Result<void> drive(Agent& agent, bool realtime, int patience_s) {
  const auto start = Clock::now();
  auto last_progress = start;
  uint32_t frames = 0;
  uint32_t unacknowledged = 0;
  while (g_stop == 0) {
    const auto taken = agent.takeFrame();
    if (!taken) return taken.error();
    if (*taken == Agent::Progress::kEnded) return {};
    if (auto exchanged = agent.exchange(milliseconds(*taken == Agent::Progress::kWaiting ? 20 : 0)); !exchanged)
      return exchanged;
    if (*taken == Agent::Progress::kFrame || agent.unacknowledged() != unacknowledged) last_progress = Clock::now();
    unacknowledged = agent.unacknowledged();
    if (Clock::now() - last_progress > seconds(patience_s)) return silentCore(agent, patience_s);
    const AgentStatistics& taken_so_far = agent.statistics();
    if (!realtime || taken_so_far.frames == frames) continue;
    frames = taken_so_far.frames;
    const auto due = start + std::chrono::nanoseconds(taken_so_far.last_stamp_ns - taken_so_far.first_stamp_ns);
    while (Clock::now() < due)
      if (auto exchanged =
              agent.exchange(std::chrono::duration_cast<milliseconds>(due - Clock::now()) + milliseconds(1));
          !exchanged)
        return exchanged;
  }
  return agent.closeKeyframe();
}

// After the last frame: until the core has all keyframes in its map and no more tiles come.
Result<void> settle(Agent& agent, int patience_s) {
  constexpr milliseconds kInterestPeriod(500), kQuiet(2500);
  auto last_progress = Clock::now(), last_news = Clock::now(), last_interest = Clock::now() - kInterestPeriod;
  uint32_t unacknowledged = agent.unacknowledged();
  uint32_t mapped = agent.mappedBelow();
  uint64_t tiles = agent.statistics().tiles_received;
  while (g_stop == 0) {
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
      return silentCore(agent, patience_s);
    }
  }
  return {};
}

Result<void> work(Agent& agent, const AgentConfig& config, const Link& link, const Arguments& arguments) {
  if (auto greeted = agent.hello(); !greeted) return greeted;
  if (auto found = awaitCore(config, link, arguments.patience_s); !found) return found;
  if (auto driven = drive(agent, arguments.realtime, arguments.patience_s); !driven) return driven;
  return settle(agent, arguments.patience_s);
}

int run(const Arguments& arguments) {
  auto config = configure(arguments);
  if (!config) return failWith(config.error());
  if (arguments.print_config) {
    std::printf("%s", printAgentConfig(*config).c_str());
    return 0;
  }
  if (arguments.check_config) return 0;
  if (config->source.empty())
    return failWith({ErrorCode::kWrongUse, "no source: give --source or 'source' in the configuration"});
  if (auto writable = checkFolderOf(arguments.report); !writable) return failWith(writable.error());
  auto source = openSource(config->source);
  if (!source) return failWith(source.error());
  auto link = connectDds(config->link);
  if (!link) return failWith(link.error());
  const auto log = [](const std::string& line) { std::fprintf(stderr, "%s\n", line.c_str()); };
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
  Agent agent(*config, newSession(), **source, **link, log, record);
  const auto done = work(agent, *config, **link, arguments);
  // What was done is told even if it ended badly.
  if (report)
    if (auto written = report->finish(reportOf(config->robot, agent)); !written) return failWith(written.error());
  if (!done) return failWith(done.error());
  if (!agent.allAcknowledged())
    return failWith({ErrorCode::kProblem, "stopped with " + std::to_string(agent.unacknowledged()) +
                                              " keyframes not acknowledged by the core: they are lost"});
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
  app.add_option("--interface", arguments.interface_address, "IPv4 address of the network interface to use");
  app.add_flag("--insecure", arguments.insecure, "Allow clear text on an interface other than loopback");
  app.add_option("--report", arguments.report, "Write what was done to this JSON file at the end");
  app.add_option("--patience", arguments.patience_s, "Seconds without the core before giving up")
      ->check(CLI::Range(1, 86400))
      ->capture_default_str();
  app.add_option("--threads", arguments.threads, "Threads that share a frame's odometry; 1 unless configured")
      ->check(CLI::Range(1, 64));
  app.add_flag("--realtime", arguments.realtime, "Play a recording at its own speed");
  app.add_flag("--list-sources", arguments.list_sources, "Print the kinds of sources and stop");
  app.add_flag("--print-config", arguments.print_config, "Print the configuration in force and stop");
  app.add_flag("--check-config", arguments.check_config, "Check the configuration and stop");
  app.set_version_flag("--version", "edge_agent " COMAP_VERSION);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  if (arguments.list_sources) {
    for (const std::string& line : comap::knownSources()) std::printf("%s\n", line.c_str());
    return 0;
  }
  struct sigaction action {};
  action.sa_handler = [](int) { comap::g_stop = 1; };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  return comap::run(arguments);
}
