#include "fleet_tools/command_line/progress.h"

#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <cstdio>
#include <utility>

namespace comap {
namespace {

constexpr double kTellAfter_s = 2;

std::string timeText(double seconds) {
  if (seconds < 90) return fmt::format("{:.0f} s", seconds);
  if (seconds < 90 * 60) return fmt::format("{:.0f} min", seconds / 60);
  return fmt::format("{:.1f} h", seconds / 3600);
}

}  // namespace

Progress::Progress(std::string what) : what_(std::move(what)), terminal_(isatty(STDERR_FILENO) != 0) {}

Progress::~Progress() {
  if (any_) std::fprintf(stderr, "\r\033[K");
}

void Progress::show(size_t done, size_t all) {
  if (!terminal_) return;
  const Clock::time_point now = Clock::now();
  if (any_ && now - shown_ < std::chrono::milliseconds(100)) return;
  shown_ = now;
  any_ = true;
  const double seconds = std::chrono::duration<double>(now - start_).count();
  std::fprintf(stderr, "\r\033[K%s: %s", what_.c_str(), progressText(done, all, seconds).c_str());
}

std::string progressText(size_t done, size_t all, double seconds) {
  if (all == 0) return "nothing to do";
  std::string text = fmt::format("{} of {}, {} %", done, all, 100 * done / all);
  if (seconds >= kTellAfter_s && done > 0 && done < all)
    text += ", " + timeText(seconds * static_cast<double>(all - done) / static_cast<double>(done)) + " left";
  return text;
}

}  // namespace comap
