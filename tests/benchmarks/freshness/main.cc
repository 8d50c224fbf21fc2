// Starts a core and robots as programs over DDS, plays recordings at their own speed, and tells how soon what one robot
// has seen is on the others.
#include <spdlog/fmt/fmt.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <thread>

#include "tests/benchmarks/command_line.h"
#include "tests/benchmarks/freshness/freshness.h"
#include "tests/benchmarks/quantile.h"
#include "tests/end_to_end/background.h"

namespace comap {
namespace {

using Json = nlohmann::json;

struct Arguments {
  std::vector<std::string> robots;  // NAME=SOURCE
  std::string out;
  int domain = 99, budget_kB_per_s = 4000;
};

// The whole map is in reach, so that what a robot holds can be compared with it.
std::string writeConfig(const Arguments& arguments) {
  const std::string path = arguments.out + "/robot.yaml";
  std::ofstream(path) << "downlink: {radius_m: 1000, budget_bytes_per_s: " << arguments.budget_kB_per_s * 1000
                      << "}\nlocalizer: {memory_mb: 512}\n";
  return path;
}

bool play(const Arguments& arguments, const std::vector<std::string>& names) {
  const std::string& out = arguments.out;
  const std::string site = "freshness-" + std::to_string(getpid()), domain = std::to_string(arguments.domain);
  const std::string config = writeConfig(arguments);
  Background core(
      "mapping_core",
      {"--domain", domain, "--core-site", site, "--store", out + "/map.comap", "--trace", out + "/core.json"},
      out + "/core.log");
  std::this_thread::sleep_for(std::chrono::seconds(3));  // its kernels are compiled
  std::vector<std::unique_ptr<Background>> agents;
  for (size_t i = 0; i < names.size(); ++i)
    agents.push_back(std::make_unique<Background>(
        "edge_agent",
        std::vector<std::string>{"--config", config, "--domain", domain, "--core-site", site, "--robot", names[i],
                                 "--source", "tum:" + arguments.robots[i].substr(names[i].size() + 1), "--realtime",
                                 "--preload", "--outbox", "memory", "--trace", out + "/" + names[i] + ".json"},
        out + "/" + names[i] + ".log"));
  bool good = true;
  for (const auto& agent : agents) good = agent->wait() == 0 && good;
  return core.end(SIGTERM) == 0 && good;
}

void tell(const char* what, const std::vector<double>& values_s) {
  if (values_s.empty()) {
    fmt::print("{}: never\n", what);
    return;
  }
  fmt::print("{}: median {:.3f} s, p95 {:.3f} s, worst {:.3f} s of {}\n", what, quantileOf(values_s, 0.5),
             quantileOf(values_s, 0.95), quantileOf(values_s, 1), values_s.size());
}

int run(const Arguments& arguments) {
  std::vector<std::string> names;
  for (const std::string& robot : arguments.robots) {
    const size_t equals = robot.find('=');
    if (equals == 0 || equals == std::string::npos) {
      fmt::print(stderr, "--robot {}: NAME=DIR is expected\n", robot);
      return 2;
    }
    names.push_back(robot.substr(0, equals));
  }
  std::error_code error;
  std::filesystem::create_directories(arguments.out, error);
  if (error || !std::filesystem::is_empty(arguments.out)) {
    fmt::print(stderr, "--out {}: cannot be made, or is not empty\n", arguments.out);
    return 2;
  }
  if (!play(arguments, names)) {
    fmt::print(stderr, "a program failed: see the logs in {}\n", arguments.out);
    return 3;
  }
  const auto trace = [&](const std::string& name) {
    std::ifstream file(arguments.out + "/" + name + ".json");
    return Json::parse(file);
  };
  const Json core = trace("core");
  std::map<std::string, Json> robots;
  for (const std::string& name : names) robots[name] = trace(name);
  const Freshness fresh = freshnessOf(core, robots);
  tell("keyframe made -> tile held by another robot", fresh.latency_s);
  tell("  of it, tile renewed by the core -> held", fresh.since_renewed_s);
  tell("  held in full, not only its coarse form", fresh.full_latency_s);
  fmt::print("  gone before they were sent: {}\n", fresh.never);
  const auto budget = static_cast<size_t>(arguments.budget_kB_per_s) * 1000;
  bool good = !fresh.latency_s.empty() && quantileOf(fresh.latency_s, 0.5) < 1 && quantileOf(fresh.latency_s, 0.95) < 3;
  for (const std::string& name : names) {
    const Downlink down = downlinkOf(core, name);
    const Ending ending = endingOf(core, robots.at(name));
    fmt::print(
        "{:>4}: {:8.1f} kB of tiles, worst second {:7.1f} of {} kB; ends in {} with {} tiles, {}, {:.1f} s after it "
        "last changed\n",
        name, 1e-3 * static_cast<double>(down.bytes), 1e-3 * static_cast<double>(down.worst_second),
        arguments.budget_kB_per_s, ending.map, ending.tiles,
        !ending.same   ? "not compared"
        : *ending.same ? "all as the core's"
                       : "NOT the core's",
        ending.rest_s);
    good = good && down.worst_second <= budget && ending.same.value_or(false);
  }
  if (fresh.latency_s.empty())
    fmt::print(stderr,
               "freshness_benchmark: nothing that one robot saw came to another: the maps share nothing, or became one "
               "too late; their keyframes and matches are in {}/map.comap\n",
               arguments.out);
  return good ? 0 : 1;
}

}  // namespace
}  // namespace comap

int main(int argc, char** argv) {
  comap::Arguments arguments;
  CLI::App app("How soon what one robot has seen is on the others, and what it costs.", "freshness_benchmark");
  app.footer(
      "Exit codes: 0 median < 1 s, p95 < 3 s and no second above the budget, 1 not so, 2 wrong use, 3 it failed.");
  app.add_option("--robot", arguments.robots, "NAME=DIR[@FIRST:LAST], a recording; one for each robot")->required();
  app.add_option("--out", arguments.out, "Empty folder for traces and logs")->required();
  app.add_option("--budget", arguments.budget_kB_per_s, "Downlink of each robot, kB/s")->check(CLI::Range(1, 1000000));
  app.add_option("--domain", arguments.domain, "DDS domain")->check(CLI::Range(0, 230));
  if (const auto code = comap::endOfParsing(app, argc, argv)) return *code;
  return comap::run(arguments);
}
