#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

#include "edge_agent/capture/source_uri.h"
#include "fleet_tools/keys/keys_folder.h"
#include "fleet_tools/replay/child_process.h"
#include "fleet_tools/replay/replay.h"
#include "fleet_tools/replay/run_folder.h"
#include "protocol/link/dds_link.h"

namespace comap {
namespace {

constexpr std::chrono::seconds kCorePatience{900};  // it fuses the whole map anew before it ends

std::string reportPath(const std::string& run, const std::string& who) { return run + "/logs/" + who + ".report.json"; }
std::string logPath(const std::string& run, const std::string& who) { return run + "/logs/" + who + ".log"; }

Error failed(const std::string& who, int code, const ChildProcess& process) {
  const std::string how = code > 128 ? " was killed by signal " + std::to_string(code - 128)
                                     : " ended with exit code " + std::to_string(code);
  return {code == 2   ? ErrorCode::kWrongUse
          : code == 1 ? ErrorCode::kProblem
                      : ErrorCode::kUnreachable,
          who + how + "; its last words: " + process.lastWords()};
}

// Until every robot has ended, the core must live.
Result<void> awaitRobots(const ReplayOptions& options, ChildProcess& core, std::vector<ChildProcess>& robots,
                         const ReplayProgress& progress) {
  for (;;) {
    size_t ended = 0;
    for (size_t i = 0; i < robots.size(); ++i) {
      const auto code = robots[i].exitCode();
      if (!code) continue;
      if (*code != 0) return failed("robot " + options.robots[i].name, *code, robots[i]);
      ++ended;
    }
    progress("robots done", ended, robots.size());
    if (ended == robots.size()) return {};
    if (const auto code = core.exitCode()) return failed("mapping_core", *code, core);
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  }
}

// Keys are good for the site they were made for; without keys the process id keeps runs apart.
Result<std::string> siteOf(const ReplayOptions& options) {
  if (options.keys.empty()) return "replay-" + std::to_string(getpid());
  return siteOfKeys(options.keys);
}

// What both programs must agree on; all else is default.
Result<std::string> writeConfig(const ReplayOptions& options) {
  const std::string path = options.out + "/logs/config.yaml";
  std::ofstream file(path);
  file << "ferns:\n  seed: " << options.fern_seed << "\n";
  file.close();
  if (!file) return Error{ErrorCode::kUnreachable, path + ": cannot be written"};
  return path;
}

}  // namespace

Result<ReplayOutcome> replayDds(const ReplayOptions& options, const ReplayProgress& progress) {
  const auto start = std::chrono::steady_clock::now();
  for (const ReplayRobot& robot : options.robots) {
    const auto source = openSource(robot.source);  // a wrong folder is told before anything is started
    if (!source) return Error{source.error().code, "robot " + robot.name + ": " + source.error().text};
  }
  std::error_code ignored;
  std::filesystem::create_directories(options.out + "/logs", ignored);
  const int domain = options.domain >= 0 ? options.domain : 100 + static_cast<int>(getpid() % 120);
  const auto config = writeConfig(options);
  if (!config) return config.error();
  const auto site_name = siteOf(options);
  if (!site_name) return site_name.error();
  const std::vector<std::string> site = {"--config",    *config,   "--domain", std::to_string(domain),
                                         "--core-site", *site_name};
  const auto giveKeys = [&](std::vector<std::string>& arguments, const std::string& name) {
    if (options.keys.empty()) return;
    arguments.push_back("--keys");
    arguments.push_back(options.keys + "/" + name);
  };

  const std::string folder = programFolder();
  std::vector<std::string> arguments = site;
  giveKeys(arguments, "core");
  for (const std::string& argument : {std::string("--store"), storePathOf(options.out), std::string("--device"),
                                      options.device, std::string("--report"), reportPath(options.out, "core")})
    arguments.push_back(argument);
  auto core = ChildProcess::start(folder + "/mapping_core", arguments, logPath(options.out, "core"), "comap-core");
  if (!core) return core.error();

  std::vector<ChildProcess> robots;
  for (const ReplayRobot& robot : options.robots) {
    arguments = site;
    giveKeys(arguments, robot.name);
    for (const std::string& argument :
         {std::string("--robot"), robot.name, std::string("--source"), robot.source, std::string("--report"),
          reportPath(options.out, robot.name), std::string("--outbox"), std::string("memory")})
      arguments.push_back(argument);
    if (options.realtime) arguments.push_back("--realtime");
    auto process =
        ChildProcess::start(folder + "/edge_agent", arguments, logPath(options.out, robot.name), "comap-edge");
    if (!process) return process.error();
    robots.push_back(std::move(*process));
  }
  if (auto ended = awaitRobots(options, *core, robots, progress); !ended) return ended.error();

  progress("the core fuses the map anew", 0, 1);
  const auto code = core->stop(kCorePatience);
  if (!code) return Error{ErrorCode::kProblem, "mapping_core did not end in time: " + core->lastWords()};
  if (*code != 0) return failed("mapping_core", *code, *core);
  progress("the core fuses the map anew", 1, 1);

  ReplayOutcome outcome;
  for (const ReplayRobot& robot : options.robots) {
    auto report = readAgentReport(reportPath(options.out, robot.name));
    if (!report) return report.error();
    outcome.robots.push_back(std::move(*report));
  }
  auto report = readCoreReport(reportPath(options.out, "core"));
  if (!report) return report.error();
  outcome.core = std::move(*report);
  outcome.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return outcome;
}

}  // namespace comap
