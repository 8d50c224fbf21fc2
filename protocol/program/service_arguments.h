// What both programs that run as services, core and agent, take on their command lines.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "protocol/link/dds_link.h"
#include "protocol/ros2/ros2_node.h"
#include "protocol/telemetry/telemetry.h"

namespace comap {

struct ServiceArguments {
  std::string config, site, interface_address, discovery, keys, report, status_address, log_format, trace;
  int domain = -1, status_port = -1;  // -1: not given
  bool insecure = false, health = false, ros2 = false, print_config = false, check_config = false;
};

/// As the words of a command line ask for it, or the configuration that they name, before either is known to be right:
/// for what is told until then.
Log earlyLog(int argc, const char* const* argv, const std::string& program);

/// An empty value of an option is refused, in verbs as well: a mistake of whoever wrote the command (a variable without
/// a value, say), not the same as no option.
void refuseEmptyValues(CLI::App& app);

/// Parses; an empty value is as wrong as an unknown option. The exit code if the program is to end: 0 if only help,
/// version or the like was asked for, 2 if the command line is wrong, which `log` is told.
std::optional<int> parse(CLI::App& app, int argc, const char* const* argv, const Log& log);

/// Adds the options that fill `arguments`, which must live until `app` has parsed. `site` and `ros2` say in the help
/// what these mean for the program.
void addServiceOptions(CLI::App& app, ServiceArguments& arguments, const std::string& site, const std::string& ros2);

/// What was given goes before what the configuration says; notices of the link go to the log that `telemetry` asks for,
/// after `prefix`. Errors are those of checkRos2Options, if ROS 2 is enabled.
Result<void> apply(const ServiceArguments& arguments, const std::string& program, const std::string& prefix,
                   DdsLinkOptions& link, TelemetryOptions& telemetry, ros2::Ros2Options& ros2);

/// For --check-config: the keys that the configuration names, as checkDdsOptions() does; the network of the machine
/// that will run it may be another.
Result<void> checkKeysOf(DdsLinkOptions link);

}  // namespace comap
