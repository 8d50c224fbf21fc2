#include "protocol/telemetry/telemetry.h"

#include <spdlog/fmt/fmt.h>

#include "protocol/config/yaml_text.h"
#include "protocol/telemetry/ask_status.h"
#include "protocol/telemetry/stage_clock.h"

namespace comap {

void readTelemetryOptions(ConfigReader& reader, TelemetryOptions& options) {
  ConfigReader status = reader.section("status");
  status.read("address", options.status_address);
  status.read("port", options.status_port, 0, 65535);
  reader.section("log").read("format", options.log_format, {"text", "json"});
}

std::string printTelemetryOptions(const TelemetryOptions& options) {
  return fmt::format(
      R"(status:                  # /metrics for Prometheus, /healthz and /readyz for who starts and stops programs
  address: {}   # where it listens; the page is clear text for anyone who reaches it
  port: {}                # 0: no status page
log:
  format: {}           # text, or json: an object a line
)",
      yamlText(options.status_address), options.status_port, options.log_format);
}

Log makeLog(const TelemetryOptions& options, const std::string& program) {
  return Log(options.log_format == "json" ? LogFormat::kJson : LogFormat::kText, program);
}

int askHealth(const TelemetryOptions& options, const Log& log) {
  if (options.status_port == 0) {
    log.error("no status page: give --status-port or status.port, as to the program that is asked");
    return exitCodeOf(ErrorCode::kWrongUse);
  }
  const auto answer = askStatus(options.status_address, options.status_port, "/healthz");
  if (!answer) {
    log.error(answer.error().text);
    return exitCodeOf(answer.error().code);
  }
  std::printf("%s\n", answer->c_str());
  return 0;
}

Result<Telemetry> Telemetry::start(const TelemetryOptions& options) {
  Telemetry telemetry;
  if (!options.trace.empty())
    if (auto traced = StageClock::process().traceTo(options.trace); !traced) return traced.error();
  if (options.status_port > 0) {
    auto server = StatusServer::start(options.status_address, options.status_port);
    if (!server) return server.error();
    telemetry.server_ = std::move(*server);
  }
  return telemetry;
}

void Telemetry::tell(const std::string& prefix, const std::function<Report()>& report) {
  constexpr std::chrono::seconds kPeriod(1);
  const auto now = std::chrono::steady_clock::now();
  if (told_ != std::chrono::steady_clock::time_point() && now - told_ < kPeriod) return;
  told_ = now;
  Report told = report();
  manager_.alive(told.readiness.state);
  if (stopping_s_ > 0) manager_.stopping(stopping_s_);  // anew from now: as long as it goes on it may take
  if (!server_) return;
  for (const auto& [stage, times] : StageClock::process().times()) {
    told.labels["stage"] = stage;
    told.metrics.summary(prefix + "_stage_seconds", "Time spent in each stage of the work.", times, told.labels);
  }
  told.metrics.process();
  server_->publish(told.metrics.text(), std::move(told.readiness));
}

Result<void> Telemetry::finish() { return StageClock::process().endTrace(); }

}  // namespace comap
