#include "protocol/telemetry/stage_clock.h"

#include <unistd.h>

#include <cerrno>
#include <cinttypes>
#include <cstring>
#include <filesystem>

#include "protocol/types/whole_file.h"

namespace comap {
namespace {

Error cannotWrite(const std::string& path) {
  return {ErrorCode::kUnreachable, path + ": the trace cannot be written: " + std::strerror(errno)};
}

int64_t microseconds(std::chrono::steady_clock::duration time) {
  return std::chrono::duration_cast<std::chrono::microseconds>(time).count();
}

}  // namespace

StageClock& StageClock::process() {
  static StageClock clock;
  return clock;
}

Result<void> StageClock::checkTrace(const std::string& path) {
  std::error_code none;
  if (!std::filesystem::is_character_file(path, none)) {  // a pipe that nobody reads would not even open
    if (auto regular = checkRegular(path); !regular) return regular;
  }
  return checkReplaceable(path, FileKind::kJson);
}

Result<void> StageClock::traceTo(const std::string& path) {
  if (auto free = checkTrace(path); !free) return free;
  const std::scoped_lock lock(mutex_);
  trace_.reset(std::fopen(path.c_str(), "w"));
  if (!trace_) return cannotWrite(path);
  trace_path_ = path;
  first_ = true;
  std::fputs("[", trace_.get());  // readers of this format take a list that is cut off
  return {};
}

Result<void> StageClock::endTrace() {
  const std::scoped_lock lock(mutex_);
  if (!trace_) return {};
  std::fputs("\n]\n", trace_.get());
  const bool written = std::ferror(trace_.get()) == 0;
  if (std::fclose(trace_.release()) != 0 || !written) return cannotWrite(trace_path_);
  return {};
}

void StageClock::add(const char* stage, std::chrono::steady_clock::time_point begin,
                     std::chrono::steady_clock::time_point end) {
  const std::scoped_lock lock(mutex_);
  times_[stage].add(std::chrono::duration<double, std::milli>(end - begin).count());
  if (!trace_) return;
  std::fprintf(trace_.get(),
               "%s\n{\"name\":\"%s\",\"ph\":\"X\",\"pid\":%d,\"tid\":%d,\"ts\":%" PRId64 ",\"dur\":%" PRId64 "}",
               first_ ? "" : ",", stage, static_cast<int>(getpid()), static_cast<int>(gettid()),
               microseconds(begin.time_since_epoch()), microseconds(end - begin));
  first_ = false;
}

bool StageClock::traces() const {
  const std::scoped_lock lock(mutex_);
  return trace_ != nullptr;
}

void StageClock::note(const char* event, const std::string& arguments) {
  const std::scoped_lock lock(mutex_);
  if (!trace_) return;
  std::fprintf(trace_.get(),
               "%s\n{\"name\":\"%s\",\"ph\":\"i\",\"s\":\"p\",\"pid\":%d,\"tid\":%d,\"ts\":%" PRId64 ",\"args\":%s}",
               first_ ? "" : ",", event, static_cast<int>(getpid()), static_cast<int>(gettid()),
               microseconds(std::chrono::steady_clock::now().time_since_epoch()), arguments.c_str());
  first_ = false;
}

std::map<std::string, TimeHistogram> StageClock::times() const {
  const std::scoped_lock lock(mutex_);
  return times_;
}

}  // namespace comap
