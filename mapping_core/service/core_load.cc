#include "mapping_core/service/core_load.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

namespace comap {
namespace {

double seconds(CoreLoad::Clock::duration time) { return std::chrono::duration<double>(time).count(); }

}  // namespace

void CoreLoad::forget(Clock::time_point now) {
  while (!arrivals_.empty() && now - arrivals_.front() > kWindow) arrivals_.pop_front();
  while (!mapped_.empty() && now - mapped_.front().at > kWindow) mapped_.pop_front();
}

void CoreLoad::arrived(Clock::time_point now) {
  if (!since_) since_ = now;
  arrivals_.push_back(now);
  forget(now);
}

void CoreLoad::mapped(Clock::time_point now, Clock::duration took) {
  if (!since_) since_ = now;
  mapped_.push_back({now, took});
  forget(now);
}

CoreLoad::Figure CoreLoad::figure(Clock::time_point now) const {
  Figure figure;
  if (!since_) return figure;
  constexpr double kShortest_s = 1;  // a first keyframe alone tells no rate
  const double window_s = std::clamp(seconds(now - *since_), kShortest_s, seconds(kWindow));
  const auto recent = [&](Clock::time_point at) { return now - at <= kWindow; };
  figure.arriving_per_s = static_cast<double>(std::count_if(arrivals_.begin(), arrivals_.end(), recent)) / window_s;
  double took_s = 0;
  size_t count = 0;
  for (const Mapped& one : mapped_)
    if (recent(one.at)) took_s += seconds(one.took), ++count;
  if (count > 0) figure.keyframe_s = took_s / static_cast<double>(count);
  return figure;
}

std::optional<std::string> CoreLoad::advise(Clock::time_point now, size_t waiting) {
  constexpr std::chrono::minutes kPause(10);
  constexpr double kBehind_s = 30;
  const Figure heard = figure(now);
  const double behind_s = static_cast<double>(waiting) * heard.keyframe_s;
  const bool watched = since_ && now - *since_ >= kWindow;
  if (!watched || heard.load() <= 1 || behind_s < kBehind_s) return {};
  if (advised_ && now - *advised_ < kPause) return {};
  advised_ = now;
  return fmt::format(
      "this core is too small for its robots: {:.1f} keyframes/s arrive, {:.1f} can be mapped (load {:.2f}), {} wait "
      "and "
      "the map is {:.0f} s behind. Nothing is lost. Give it a GPU (--device, --list-devices), make robots send less "
      "(keyframes.* in robot.yaml), or give some robots a core and a site of their own",
      heard.arriving_per_s, 1 / heard.keyframe_s, heard.load(), waiting, behind_s);
}

}  // namespace comap
