#include "fleet_tools/replay/interruption.h"

#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <csignal>

namespace comap {
namespace {

// A signal's handler may use nothing but this.
std::string interrupted_text;  // NOLINT: written once, before the handler is there

void onInterrupt(int signal) {
  [[maybe_unused]] const auto written = write(STDERR_FILENO, interrupted_text.data(), interrupted_text.size());
  std::signal(signal, SIG_DFL);
  raise(signal);
}

}  // namespace

void tellWhenInterrupted(const std::string& what) {
  interrupted_text = fmt::format("{}fleet: interrupted: {}\n", isatty(STDERR_FILENO) != 0 ? "\n" : "", what);
  std::signal(SIGINT, onInterrupt);
  std::signal(SIGTERM, onInterrupt);
}

}  // namespace comap
