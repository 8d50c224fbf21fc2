// What a program tells those who operate it: log lines, a status page, its service manager, a trace of its stages.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "protocol/config/config_reader.h"
#include "protocol/telemetry/log.h"
#include "protocol/telemetry/metrics_page.h"
#include "protocol/telemetry/service_manager.h"
#include "protocol/telemetry/status_server.h"

namespace comap {

struct TelemetryOptions {
  std::string status_address = "127.0.0.1";  ///< where the status page listens
  int status_port = 0;                       ///< 0 = no status page
  std::string log_format = "text";           ///< text or json
  std::string trace;                         ///< file for the stages' time line; empty = none
};

/// Reads the sections `status` and `log`.
void readTelemetryOptions(ConfigReader& reader, TelemetryOptions& options);
/// The same sections as commented YAML.
std::string printTelemetryOptions(const TelemetryOptions& options);

/// Asks the status page of a program that runs with these options whether it is well. Prints what it says.
/// Returns the exit code: 0 well, 1 not, 2 it has no status page, 3 no answer.
int askHealth(const TelemetryOptions& options, const Log& log);

Log makeLog(const TelemetryOptions& options, const std::string& program);

/// Thread rule: one thread.
class Telemetry {
 public:
  struct Report {
    MetricsPage metrics;
    Readiness readiness;
    MetricsPage::Labels labels = {};  ///< of the times of stages, besides the stage
  };

  /// kUnreachable if the port or the trace's file cannot be had.
  static Result<Telemetry> start(const TelemetryOptions& options);

  /// Tells what `report` gives, unless it did so less than a second ago. Call it often: who does not for a minute
  /// counts as stuck. Also adds the times of stages, under `prefix`_stage_seconds, and the process's own numbers.
  void tell(const std::string& prefix, const std::function<Report()>& report);

  /// The end has begun; it may take up to `seconds` from each further tell() on.
  void stopping(int seconds) {
    told_ = {};
    manager_.stopping(stopping_s_ = seconds);
  }

  /// The port of the status page; 0 if there is none.
  int port() const { return server_ ? server_->port() : 0; }

  /// Completes the trace. kUnreachable if it could not be written.
  Result<void> finish();

 private:
  Telemetry() = default;
  std::unique_ptr<StatusServer> server_;
  ServiceManager manager_;
  std::chrono::steady_clock::time_point told_{};
  int stopping_s_ = 0;
};

}  // namespace comap
