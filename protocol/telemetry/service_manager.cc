#include "protocol/telemetry/service_manager.h"

#include <systemd/sd-daemon.h>

#include <algorithm>

namespace comap {

void ServiceManager::alive(const std::string& state) {
  std::string message = "WATCHDOG=1\n";
  if (!told_ready_) message += "READY=1\n";
  if (state != told_state_) {
    std::string line = state;
    std::replace(line.begin(), line.end(), '\n', ' ');
    message += "STATUS=" + line + "\n";
  }
  // What cannot be told is told the next time.
  if (sd_notify(0, message.c_str()) <= 0) return;
  told_ready_ = true;
  told_state_ = state;
}

void ServiceManager::stopping(int seconds) {
  const std::string message = "STOPPING=1\nEXTEND_TIMEOUT_USEC=" + std::to_string(int64_t{seconds} * 1'000'000);
  sd_notify(0, message.c_str());
}

}  // namespace comap
