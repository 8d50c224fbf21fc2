#include "protocol/program/service_arguments.h"

#include "protocol/config/config_reader.h"
#include "protocol/program/command_description.h"

namespace comap {
namespace {

// "--name VALUE" or "--name=VALUE"; empty if it is not there.
std::string valueOf(const std::string& name, int argc, const char* const* argv) {
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == name && i + 1 < argc) return argv[i + 1];
    if (word.starts_with(name + "=")) return word.substr(name.size() + 1);
  }
  return {};
}

}  // namespace

void refuseEmptyValues(CLI::App& app) {
  for (CLI::Option* option : app.get_options()) {
    if (option->get_expected_max() == 0) continue;  // a flag
    option->check([](const std::string& value) { return value.empty() ? "its value is empty" : std::string(); });
  }
  for (CLI::App* verb : app.get_subcommands({})) refuseEmptyValues(*verb);
}

Log earlyLog(int argc, const char* const* argv, const std::string& program) {
  TelemetryOptions options;
  options.log_format = valueOf("--log-format", argc, argv);
  const std::string config = valueOf("--config", argc, argv);
  if (options.log_format.empty() && !config.empty())
    if (auto reader = ConfigReader::fromFile(config)) readTelemetryOptions(*reader, options);
  return makeLog(options, program);
}

std::optional<int> parse(CLI::App& app, int argc, const char* const* argv, const Log& log) {
  refuseEmptyValues(app);
  try {
    app.parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    log.error(std::string(error.what()) + ": --help tells what there is");
    return exitCodeOf(ErrorCode::kWrongUse);
  }
}

void addServiceOptions(CLI::App& app, ServiceArguments& arguments, const std::string& site, const std::string& ros2) {
  app.add_option("--config", arguments.config, "YAML file; --print-config shows all keys");
  app.add_option("--core-site", arguments.site, site);
  app.add_option("--domain", arguments.domain, "DDS domain")->check(CLI::Range(0, 230));
  app.add_option("--interface", arguments.interface_address, "Network interface to use: its IPv4 address, or its name");
  app.add_option("--discovery", arguments.discovery,
                 "HOST or HOST:PORT of a discovery server, for networks without multicast");
  app.add_option("--keys", arguments.keys, "Folder of this program's keys, made by fleet keys: messages are encrypted");
  app.add_flag("--insecure", arguments.insecure, "Allow clear text on an interface other than loopback");
  app.add_option("--report", arguments.report, "Write what was done to this JSON file at the end");
  app.add_option("--status-port", arguments.status_port, "Port of /metrics, /healthz and /readyz; 0: none")
      ->check(CLI::Range(0, 65535));
  app.add_option("--status-address", arguments.status_address, "Address where it listens; 127.0.0.1 unless told");
  app.add_flag("--health", arguments.health, "Ask the status page of the one that runs whether it is well, and stop");
  app.add_option("--log-format", arguments.log_format, "Lines on stderr as text or json")
      ->check(CLI::IsMember({"text", "json"}));
  app.add_option("--trace", arguments.trace, "Write when each stage of the work ran to this file, for ui.perfetto.dev");
  app.add_flag("--ros2", arguments.ros2, ros2 + "; see ros2 in --print-config");
  app.add_flag("--print-config", arguments.print_config, "Print the configuration in force and stop");
  app.add_flag("--check-config", arguments.check_config,
               "Check the configuration and stop; devices, cameras, network and files are looked at by a start alone");
  app.add_flag_callback(
      "--man", [&app] { throw CLI::CallForVersion(manPage(app, app.get_name()), 0); },
      "Print the manual page, for man -l -, and stop");
  app.add_option_function<std::string>(
         "--completion",
         [&app](const std::string& shell) {
           throw CLI::CallForVersion(shell == "bash" ? bashCompletion(app) : zshCompletion(app), 0);
         },
         "Print a script that completes options in this shell, and stop")
      ->check(CLI::IsMember({"bash", "zsh"}));
}

Result<void> apply(const ServiceArguments& arguments, const std::string& program, const std::string& prefix,
                   DdsLinkOptions& link, TelemetryOptions& telemetry, ros2::Ros2Options& ros2) {
  if (!arguments.site.empty()) link.site = arguments.site;
  if (!arguments.interface_address.empty()) link.interface_address = arguments.interface_address;
  if (arguments.domain >= 0) link.domain = arguments.domain;
  if (!arguments.discovery.empty()) link.discovery_server = arguments.discovery;
  if (!arguments.keys.empty()) link.keys = arguments.keys;
  link.insecure = link.insecure || arguments.insecure;
  if (arguments.status_port >= 0) telemetry.status_port = arguments.status_port;
  if (!arguments.status_address.empty()) telemetry.status_address = arguments.status_address;
  if (!arguments.log_format.empty()) telemetry.log_format = arguments.log_format;
  telemetry.trace = arguments.trace;
  link.notice = [prefix, log = makeLog(telemetry, program)](const std::string& line) { log.info(prefix + line); };
  ros2.enabled = ros2.enabled || arguments.ros2;
  return ros2.enabled ? checkRos2Options(ros2, link.domain) : Result<void>();
}

Result<void> checkKeysOf(DdsLinkOptions link) {
  if (link.keys.empty()) return {};
  link.profile = "auto";
  link.interface_address = "127.0.0.1";
  return checkDdsOptions(link);
}

}  // namespace comap
