// What operators rely on: metrics and health of a run, and the files in containers/ that refer to programs and metrics.
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>
#include <yaml-cpp/yaml.h>

#include <chrono>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <sstream>
#include <thread>

#include "edge_agent/agent_metrics.h"
#include "mapping_core/service/core_config.h"
#include "protocol/discovery/endpoint.h"
#include "tests/end_to_end/background.h"
#include "tests/end_to_end/flat_test.h"
#include "tests/protocol/telemetry/http_get.h"

namespace comap {
namespace {

const std::string kContainers = COMAP_SOURCE_DIR "/containers/";

// Prometheus' rules for exposed text, as its linter has them. Returns each name's type.
std::map<std::string, std::string> lint(const std::string& text) {
  static const std::regex kSample(R"(([a-z_]+)(\{[a-z]+="[^"]*"(,[a-z]+="[^"]*")*\})? ([-+0-9.e]+|NaN|[+-]Inf))");
  std::map<std::string, std::string> types;
  std::set<std::string> helped, seen;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string hash, what, name, type;
    if (line.starts_with("# ")) {
      words >> hash >> what >> name >> type;
      if (what == "HELP") helped.insert(name);
      if (what != "TYPE") continue;
      EXPECT_TRUE(types.emplace(name, type).second) << name << " stands twice";
      const bool total = name.ends_with("_total");
      EXPECT_EQ(total, type == "counter") << name << " is a " << type;
      EXPECT_TRUE(helped.contains(name)) << name << " has no help";
      EXPECT_TRUE(name.starts_with("comap_") || name.starts_with("process_")) << name;
      EXPECT_FALSE(std::regex_search(name, std::regex("_(ms|mb|kb|us|percent)(_|$)"))) << name << ": no base unit";
      continue;
    }
    EXPECT_TRUE(std::regex_match(line, kSample)) << line;
    EXPECT_TRUE(seen.insert(line.substr(0, line.rfind(' '))).second) << line << " stands twice";
  }
  return types;
}

std::set<std::string> metricsNamedIn(const std::string& path) {
  const std::string text = contentOf(path);
  EXPECT_FALSE(text.empty()) << path;
  std::set<std::string> names;
  static const std::regex kName("comap_(core|agent)_[a-z_]+");
  for (std::sregex_iterator it(text.begin(), text.end(), kName), end; it != end; ++it) {
    std::string name = it->str();
    for (const char* part : {"_sum", "_count"})
      if (name.ends_with(part)) name.resize(name.size() - std::string(part).size());
    names.insert(name);
  }
  return names;
}

class Deployment : public FlatTest {
 protected:
  // The first answer to `path` for which `enough` holds, or the last one within a minute.
  template <class Enough>
  HttpAnswer await(int port, const std::string& path, Enough enough) {
    HttpAnswer answer;
    for (int i = 0; i < 300; ++i) {
      answer = httpGet(port, path);
      if (enough(answer)) return answer;
      std::this_thread::sleep_for(std::chrono::milliseconds(200));
    }
    ADD_FAILURE() << path << " still says " << answer.status << " " << answer.body;
    return answer;
  }
};

TEST_F(Deployment, MetricsHealthAndLogsOfARunFitTheDashboardAndTheAlerts) {
  const std::string site = "deployment-" + std::to_string(getpid());
  const int core_port = freePort(), agent_port = freePort();
  const std::vector<std::string> common{"--domain", "95", "--core-site", site, "--log-format", "json"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.end(), common.begin(), common.end());
    return more;
  };
  Background core("mapping_core",
                  with({"--store", folder_.path("m.comap"), "--status-port", std::to_string(core_port), "--trace",
                        folder_.path("trace.json")}),
                  folder_.path("core.log"));
  await(core_port, "/readyz", [](const HttpAnswer& answer) { return answer.status == 200; });
  Background agent("edge_agent",
                   with({"--robot", "a", "--source", "tum:" + flat_ + "/a", "--realtime", "--outbox", "memory",
                         "--status-port", std::to_string(agent_port)}),
                   folder_.path("a.log"));
  await(agent_port, "/readyz", [](const HttpAnswer& answer) { return answer.status == 200; });
  const auto mapsSome = [](const HttpAnswer& answer) {
    return answer.body.find("comap_core_stage_seconds_count{stage=\"tiles\"}") != std::string::npos &&
           answer.body.find("comap_core_tile_bytes_total{") != std::string::npos;
  };
  const HttpAnswer agent_metrics = httpGet(agent_port, "/metrics");
  EXPECT_NE(agent_metrics.body.find("comap_agent_stage_seconds_count{robot=\"a\",stage="), std::string::npos);
  EXPECT_EQ(runProgram("edge_agent --health --status-port " + std::to_string(agent_port)).exit_code, 0);
  const HttpAnswer core_metrics = await(core_port, "/metrics", mapsSome);
  EXPECT_EQ(runProgram("mapping_core --health --status-port " + std::to_string(core_port)).exit_code, 0);
  EXPECT_EQ(runProgram("mapping_core --health").exit_code, 2);
  EXPECT_LE(agent.end(SIGTERM), 1);  // 1: what memory alone held is lost, and it says so
  EXPECT_EQ(core.end(SIGTERM), 0);
  EXPECT_EQ(runProgram("mapping_core --health --status-port " + std::to_string(core_port)).exit_code, 3);

  std::map<std::string, std::string> types = lint(core_metrics.body);
  types.merge(lint(agent_metrics.body));
  // What a run without matches does not show.
  types.emplace("comap_core_matches_total", "counter");
  types.emplace("comap_core_robot_silent_seconds", "gauge");  // once the robot has ended
  MetricsPage camera;                                         // what a run without one does not show
  CaptureHealth health;
  health.hottest_C = 40;
  addCamera(health, {{"robot", "a"}}, camera);
  types.merge(lint(camera.text()));
  for (const char* file : {"monitoring/alerts.yml", "monitoring/grafana-dashboard.json"})
    for (const std::string& name : metricsNamedIn(kContainers + file))
      EXPECT_TRUE(types.contains(name)) << file << " asks for " << name << ", which nobody tells";

  for (const char* log : {"core.log", "a.log"}) {
    std::istringstream lines(contentOf(folder_.path(log)));
    size_t count = 0;
    for (std::string line; std::getline(lines, line); ++count)
      EXPECT_TRUE(nlohmann::json::accept(line)) << log << ": " << line;
    EXPECT_GT(count, 0u) << log;
  }
  EXPECT_TRUE(nlohmann::json::accept(contentOf(folder_.path("trace.json"))));
}

TEST_F(Deployment, AnAgentWhoseRecordingHasEndedIsNotReady) {
  const int port = freePort();
  Background agent(
      "edge_agent",
      {"--domain", "95", "--core-site", "ended-" + std::to_string(getpid()), "--robot", "a", "--source",
       "tum:" + flat_ + "/a@0:10", "--realtime", "--outbox", "memory", "--status-port", std::to_string(port)},
      folder_.path("a.log"));
  const HttpAnswer ended = await(port, "/readyz", [](const HttpAnswer& answer) {
    return answer.body.find("source has ended") != std::string::npos;
  });
  EXPECT_EQ(ended.status, 503) << ended.body;
  EXPECT_EQ(httpGet(port, "/healthz").status, 200);
  agent.end(SIGTERM);
}

TEST_F(Deployment, APortThatIsTakenIsSaid) {
  const int fd = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  ASSERT_EQ(bind(fd, reinterpret_cast<const sockaddr*>(&address), size), 0);
  ASSERT_EQ(listen(fd, 1), 0);
  ASSERT_EQ(getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size), 0);
  const std::string port = std::to_string(ntohs(address.sin_port));
  const ProgramRun run = runProgram("mapping_core --domain 95 --core-site taken-" + std::to_string(getpid()) +
                                    " --store " + folder_.path("m.comap") + " --status-port " + port);
  close(fd);
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_NE(run.err.find(port), std::string::npos) << run.err;
}

// The command of a discovery server takes its options: with one that it has not, it would end with 2.
void expectServesDiscovery(const YAML::Node& command) {
  std::string words;
  for (const auto& word : command) words += word.as<std::string>() + " ";
  EXPECT_TRUE(words.starts_with("fleet discovery ")) << words;
  EXPECT_EQ(runProgram(words + "--listen 127.0.0.1:1 --ask 127.0.0.1:1").exit_code, 3) << words;
}

// Its own volume of keys, which the service `keys` fills and nobody else has; and none with the authority's.
void expectOnlyItsKeys(const YAML::Node& services, const std::string& name, const std::string& participant) {
  const std::string own = "keys-" + participant;
  std::set<std::string> mounts;
  for (const auto& volume : services[name]["volumes"]) mounts.insert(volume.as<std::string>());
  EXPECT_TRUE(mounts.contains(own + ":/keys:ro")) << name;
  for (const std::string& mount : mounts)
    EXPECT_TRUE(mount.starts_with(own + ":") || (!mount.starts_with("keys") && !mount.starts_with("authority")))
        << name << " mounts " << mount;
  std::set<std::string> filled, named;
  for (const auto& volume : services["keys"]["volumes"]) filled.insert(volume.as<std::string>());
  for (const auto& word : services["keys"]["command"]) named.insert(word.as<std::string>());
  EXPECT_TRUE(filled.contains(own + ":/keys/" + participant)) << own;
  EXPECT_TRUE(named.contains(participant)) << participant;
}

// A run under a wrong option would end at once, in somebody's cluster.
TEST(DeploymentFiles, ComposeStartsProgramsThatTakeTheirOptions) {
  const YAML::Node compose = YAML::LoadFile(kContainers + "compose.yaml");
  const YAML::Node services = compose["services"];
  const TemporaryFolder keys;
  ASSERT_EQ(runProgram("fleet keys init " + keys.path("flat") + " --site flat").exit_code, 0);
  for (const char* add : {"add-core FLAT", "add-robot FLAT a", "add-robot FLAT b", "add-robot FLAT c"}) {
    std::string command = std::string("fleet keys ") + add;
    ASSERT_EQ(runProgram(command.replace(command.find("FLAT"), 4, keys.path("flat"))).exit_code, 0) << add;
  }
  size_t checked = 0;
  for (const auto& service : services) {
    const std::string name = service.first.as<std::string>();
    for (const auto& needed : service.second["depends_on"])
      EXPECT_TRUE(services[needed.first.as<std::string>()]) << name << " needs " << needed.first;
    for (const auto& volume : service.second["volumes"]) {
      const std::string text = volume.as<std::string>();
      const std::string source = text.substr(0, text.find(':'));
      EXPECT_TRUE(source != "authority" || name == "keys") << name << " sees the authority's key";
      if (source.starts_with("./"))
        EXPECT_FALSE(contentOf(kContainers + source.substr(2)).empty()) << name << " mounts " << source;
      else
        EXPECT_TRUE(compose["volumes"][source].IsDefined()) << name << " mounts " << source;
    }
    const std::string restart = service.second["restart"] ? service.second["restart"].as<std::string>() : "";
    EXPECT_TRUE(restart.empty() || restart == "on-failure:10") << name << " would start for ever";
    if (name != "core" && !name.starts_with("robot-")) continue;
    const std::string participant = name == "core" ? name : name.substr(std::string("robot-").size());
    expectOnlyItsKeys(services, name, participant);
    std::string command = name == "core" ? "mapping_core --check-config" : "edge_agent --check-config";
    for (const auto& word : service.second["command"]) {
      const std::string text = word.as<std::string>();
      command += " " + (text == "/keys" ? keys.path("flat/" + participant) : text);
    }
    const ProgramRun run = runProgram(command);
    EXPECT_EQ(run.exit_code, 0) << command << "\n" << run.err;
    ++checked;
  }
  EXPECT_EQ(checked, 4u);
  EXPECT_EQ(compose["x-robot"]["restart"].as<std::string>(), "on-failure:10");
  const YAML::Node targets =
      YAML::LoadFile(kContainers + "monitoring/prometheus.yml")["alerting"]["alertmanagers"][0]["static_configs"][0];
  const std::string target = targets["targets"][0].as<std::string>();
  EXPECT_TRUE(services[target.substr(0, target.find(':'))]) << target;
  const YAML::Node manager = YAML::LoadFile(kContainers + "monitoring/alertmanager.yml");
  EXPECT_EQ(manager["route"]["receiver"].as<std::string>(), manager["receivers"][0]["name"].as<std::string>());
  expectServesDiscovery(services["discovery"]["entrypoint"]);
}

// A name without registry is looked for in public ones, a name without tag changes under running pods.
void expectPullable(const std::string& image) {
  EXPECT_TRUE(image.starts_with("registry.example.com/")) << image << ": what core.yaml says is to be replaced";
  EXPECT_TRUE(image.ends_with(":" COMAP_VERSION)) << image;
}

// The keys of a configuration, "link.site" and so on, with their values.
void flatten(const YAML::Node& node, const std::string& path, std::map<std::string, std::string>& found) {
  if (!node.IsMap()) {
    found[path] = YAML::Dump(node);
    return;
  }
  for (const auto& entry : node)
    flatten(entry.second, (path.empty() ? "" : path + ".") + entry.first.as<std::string>(), found);
}

// What is in /etc is asked about at an upgrade if it has changed there and in the package: no default may be in it.
TEST(DeploymentFiles, ServicesAreConfiguredByWhatDiffersFromTheDefaults) {
  for (const auto& [program, file] : {std::pair("mapping_core", "core.yaml"), std::pair("edge_agent", "robot.yaml")}) {
    std::map<std::string, std::string> ours, defaults;
    flatten(YAML::LoadFile(kContainers + "services/" + file), "", ours);
    const ProgramRun run = runProgram(std::string(program) + " --print-config");
    flatten(YAML::Load(run.out), "", defaults);
    ASSERT_GT(defaults.size(), ours.size());
    for (const auto& [key, value] : ours) {
      ASSERT_TRUE(defaults.contains(key)) << file << ": " << key;
      EXPECT_NE(value, defaults.at(key)) << file << ": " << key << " is the default";
    }
    const ProgramRun checked =
        runProgram(std::string(program) + " --check-config --config " + kContainers + "services/" + file);
    EXPECT_EQ(checked.exit_code, 0) << checked.err;
  }
}

TEST(DeploymentFiles, KubernetesManifestHoldsTogether) {
  std::map<std::string, YAML::Node> by_kind;
  for (const YAML::Node& document : YAML::LoadAllFromFile(kContainers + "kubernetes/core.yaml")) {
    EXPECT_TRUE(document["apiVersion"] && document["metadata"]["name"]) << document;
    by_kind[document["kind"].as<std::string>()] = document;
  }
  ASSERT_EQ(by_kind.size(), 3u);
  const YAML::Node set = by_kind.at("StatefulSet")["spec"], pod = set["template"]["spec"];
  EXPECT_EQ(set["selector"]["matchLabels"]["app"].as<std::string>(),
            set["template"]["metadata"]["labels"]["app"].as<std::string>());
  EXPECT_EQ(set["serviceName"].as<std::string>(), by_kind.at("Service")["metadata"]["name"].as<std::string>());
  EXPECT_TRUE(pod["securityContext"]["runAsNonRoot"].as<bool>());

  std::set<std::string> volumes;
  for (const auto& volume : pod["volumes"]) volumes.insert(volume["name"].as<std::string>());
  for (const auto& claim : set["volumeClaimTemplates"]) volumes.insert(claim["metadata"]["name"].as<std::string>());
  for (const char* kind : {"containers", "initContainers"})
    for (const auto& container : pod[kind]) {
      EXPECT_TRUE(container["securityContext"]["readOnlyRootFilesystem"].as<bool>());
      EXPECT_FALSE(container["securityContext"]["allowPrivilegeEscalation"].as<bool>());
      for (const auto& mount : container["volumeMounts"])
        EXPECT_TRUE(volumes.contains(mount["name"].as<std::string>())) << mount["name"];
    }
  const YAML::Node core = pod["containers"][0];
  expectPullable(core["image"].as<std::string>());
  EXPECT_TRUE(core["resources"]["limits"]["memory"]);
  std::set<std::string> ports;
  for (const auto& port : core["ports"]) ports.insert(port["name"].as<std::string>());
  for (const char* probe : {"startupProbe", "readinessProbe", "livenessProbe"})
    EXPECT_TRUE(ports.contains(core[probe]["httpGet"]["port"].as<std::string>())) << probe;

  TemporaryFolder folder;
  std::ofstream(folder.path("core.yaml")) << by_kind.at("ConfigMap")["data"]["core.yaml"].as<std::string>();
  const auto config = readCoreConfig(folder.path("core.yaml"));
  ASSERT_TRUE(config) << config.error().text;
  EXPECT_EQ(config->telemetry.status_port, core["ports"][0]["containerPort"].as<int>());

  std::map<std::string, YAML::Node> discovery;
  for (const YAML::Node& document : YAML::LoadAllFromFile(kContainers + "kubernetes/discovery.yaml"))
    discovery[document["kind"].as<std::string>()] = document;
  const YAML::Node server = discovery.at("Deployment")["spec"]["template"]["spec"]["containers"][0];
  expectServesDiscovery(server["command"]);
  expectPullable(server["image"].as<std::string>());
  const auto known = parseHostPort(config->link.discovery_server, "link.discovery_server");
  ASSERT_TRUE(known) << known.error().text;
  EXPECT_EQ(known->host, discovery.at("Service")["metadata"]["name"].as<std::string>());
  EXPECT_EQ(known->port, discovery.at("Service")["spec"]["ports"][0]["port"].as<int>());
  EXPECT_EQ(known->port, server["ports"][0]["containerPort"].as<int>());
}

}  // namespace
}  // namespace comap
