#include "protocol/telemetry/log.h"

#include <chrono>
#include <ctime>
#include <nlohmann/json.hpp>

namespace comap {
namespace {

std::string timeNow() {
  using namespace std::chrono;
  const auto now = system_clock::now();
  const std::time_t seconds = system_clock::to_time_t(now);
  const auto ms = duration_cast<milliseconds>(now.time_since_epoch()).count() % 1000;
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  char text[40];
  const size_t length = std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%S", &utc);
  std::snprintf(text + length, sizeof text - length, ".%03dZ", static_cast<int>(ms));
  return text;
}

}  // namespace

void Log::write(LogLevel level, const std::string& text) const {
  const bool error = level == LogLevel::kError;
  std::string line;
  if (format_ == LogFormat::kJson) {
    nlohmann::ordered_json json;
    json["time"] = timeNow();
    json["program"] = program_;
    json["level"] = error ? "error" : "info";
    json["text"] = text;
    line = json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  } else {
    line = (error ? program_ + ": " : "") + text;
  }
  line += '\n';
  std::fwrite(line.data(), 1, line.size(), out_);  // in one piece: lines of several threads do not mix
}

}  // namespace comap
